// What the commands do with a session that leads elsewhere, is not at rest, or was never meant to be written over.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>

#include "session/checking/checksums.hpp"
#include "session/recording/session_lock.hpp"
#include "tests/program/scanned_session.hpp"

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

namespace tankrig::test {
namespace {

using Words = std::vector<std::string>;

/// Every command that opens a session, on `session`; what it would write goes to `out`.
std::vector<Words> commands_on(const fs::path& session, const fs::path& out) {
  const std::string s = session.string(), to = out.string();
  return {{"session", "info", s},
          {"session", "check", s},
          {"session", "recover", s},
          {"session", "recover", s, "--out", to + "/recovered"},
          {"session", "replay", s},
          {"session", "export", s, "--all", "--out", to + "/export"},
          {"reconstruct", s},
          {"reconstruct", s, "--out", to + "/cloud.ply"},
          {"report", s},
          {"calibrate", "time", s}};
}

TEST(HostileSession, WithALinkIsOpenedByNoCommand) {
  const fs::path elsewhere = scratch_folder() / "elsewhere", out = scratch_folder() / "out";
  for (const char* link : {"clouds", "frames/mono"}) {
    const fs::path session = copied();
    fs::remove_all(elsewhere);
    fs::rename(session / link, elsewhere);
    fs::create_directory_symlink(elsewhere, session / link);
    const auto files = std::distance(fs::recursive_directory_iterator(elsewhere), fs::recursive_directory_iterator());
    for (const Words& command : commands_on(session, out)) {
      const ProgramRun run = run_tankrig(command);
      EXPECT_EQ(run.exit_code, 1) << testing::PrintToString(command);
      EXPECT_THAT(run.err, HasSubstr(std::string(link) + ": is a symbolic link")) << testing::PrintToString(command);
      EXPECT_EQ(std::distance(fs::recursive_directory_iterator(elsewhere), fs::recursive_directory_iterator()), files);
    }
    EXPECT_FALSE(fs::exists(out));
    fs::remove_all(session);
  }
}

TEST(HostileSession, WhoseCameraIsNamedElsewhereIsExportedNowhere) {
  const fs::path session = copied(), out = scratch_folder() / "a/b/out";
  edit(session / "session.yaml", {{"- name: \"mono\"", "- name: \"../../evil\""}});
  const ProgramRun run =
      run_tankrig({"session", "export", session.string(), "--format", "camera_info", "--out", out.string()});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("name: found '../../evil', expected a name that can be a folder's"));
  EXPECT_FALSE(fs::exists(scratch_folder() / "a"));
}

TEST(HostileSession, WithAPipeForItsDescriptionKeepsNobodyWaiting) {
  const fs::path session = copied();
  fs::remove(session / "session.yaml");
  ASSERT_EQ(::mkfifo((session / "session.yaml").c_str(), 0600), 0);
  const ProgramRun run = run_tankrig({"session", "info", session.string()});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("session.yaml: is a pipe, a socket or a device, expected a YAML file"));
}

TEST(HostileSession, WhoseRigFileStandsOnAnotherIsNotReadElsewhere) {
  const fs::path session = copied(), elsewhere = scratch_folder() / "base.yaml";
  fs::rename(session / "rig.yaml", elsewhere);
  write_text(session / "rig.yaml", "base: ../base.yaml\n");
  for (const Words& command : {Words{"session", "replay", session.string()}, {"reconstruct", session.string()}}) {
    const ProgramRun run = run_tankrig(command);
    EXPECT_EQ(run.exit_code, 1) << command[0];
    EXPECT_THAT(run.err, HasSubstr("rig.yaml:1: base: found a base, expected the rig file of a session")) << command[0];
  }
  fs::remove(session / "session.yaml");
  const ProgramRun run = run_tankrig({"session", "check", session.string()});
  EXPECT_EQ(run.exit_code, 1) << run.out;
  EXPECT_THAT(run.out, HasSubstr("missing: cameras and calibration"));
}

TEST(HostileSession, WhoseMeshNamesAFileElsewhereIsNotScored) {
  const fs::path session = copied();
  write_text(session / "one.gltf", R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
    "nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
    "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":"../corners.bin"}]})");
  const float corners[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  write_text(session / "../corners.bin", {reinterpret_cast<const char*>(corners), sizeof corners});
  edit(session / "session.yaml", {{"mesh: \"black_box.obj\"", "mesh: \"one.gltf\""}});
  ProgramRun run = run_tankrig({"report", session.string()});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("one.gltf: not readable as a mesh"));
  fs::rename(session / "../corners.bin", session / "corners.bin");
  edit(session / "one.gltf", {{"../corners.bin", "corners.bin"}});
  run = run_tankrig({"report", session.string()});
  EXPECT_NE(run.exit_code, 1) << run.err;
}

TEST(HostileSession, SendsNothingToTheTerminalButText) {
  const fs::path session = scratch_folder() / "\x1b]0;named\x07";
  fs::rename(copied(), session);
  const std::string yaml = read_text(session / "session.yaml");
  const std::size_t notes = yaml.find("notes: \"");
  write_text(session / "session.yaml",
             yaml.substr(0, notes) + "notes: \"\\x1b]0;owned\\x07\\x9b2J" + yaml.substr(notes + 8));
  ProgramRun run = run_tankrig({"session", "info", session.string()});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.out, HasSubstr("?]0;owned?"));
  edit(session / "session.yaml",
       {{"status: \"complete\"", "status: \"\\x1b[2J\""}, {"software: \"", "software: \"\\x1b[2J"}});
  for (const Words& command : {Words{"session", "info"},
                               {"session", "check"},
                               {"session", "replay"},
                               {"session", "export", "--all"},
                               {"reconstruct"},
                               {"report"}}) {
    Words line = command;
    line.push_back(session.string());
    run = run_tankrig(line);
    EXPECT_THAT(run.out + run.err, HasSubstr("?")) << testing::PrintToString(command);
    for (const char* control : {"\x1b", "\x07", "\xc2\x9b"})
      EXPECT_THAT(run.out + run.err, Not(HasSubstr(control))) << testing::PrintToString(command);
  }
  const fs::path mesh = fs::path(TANKRIG_SOURCE_DIR) / "etc/objects/black_box.obj", cloud = session / "a.ply";
  write_text(session / "pose.yaml", "translation_m: [0, 0, 0]\nquaternion_xyzw: [0, 0, 0, 1]\n");
  for (const char* points : {"0", "1"}) {
    write_text(cloud, std::string("ply\nformat ascii 1.0\ncomment frame \x07\nelement vertex ") + points +
                          "\nproperty float x\nproperty float y\nproperty float z\nend_header\n" +
                          (*points == '1' ? "9 9 9\n" : ""));
    run = run_tankrig({"evaluate", cloud.string(), "--object", mesh.string(), "--pose", session / "pose.yaml"});
    EXPECT_EQ(run.exit_code, 3);
    EXPECT_THAT(run.err, HasSubstr("/?]0;named?/a.ply: "));
    for (const char* control : {"\x1b", "\x07"}) EXPECT_THAT(run.out + run.err, Not(HasSubstr(control)));
  }
}

TEST(RecordingSession, IsLeftAloneByEverythingThatWouldAddToIt) {
  const fs::path session = copied(), out = scratch_folder() / "cloud.ply";
  const std::string seal = read_text(session / "SHA256SUMS");
  const SessionLock recording(session);  // as a recorder holds it
  const std::string s = session.string();
  for (const Words& command : {Words{"report", s},
                               {"reconstruct", s},
                               {"reconstruct", s, "--out", out.string()},
                               {"calibrate", "time", s},
                               {"session", "recover", s}}) {
    const ProgramRun run = run_tankrig(command);
    EXPECT_EQ(run.exit_code, 1) << command[0];
    EXPECT_THAT(run.err, testing::ContainsRegex("is being written (or read )?by another process")) << command[0];
  }
  EXPECT_EQ(read_text(session / "SHA256SUMS"), seal);
  EXPECT_THAT(compare_checksums(session), testing::IsEmpty());
  EXPECT_FALSE(fs::exists(out));
}

TEST(CalibrateTime, OfASessionGivenTwiceBlamesNobodyElse) {
  const ProgramRun run = run_tankrig({"calibrate", "time", scanned().string(), scanned().string() + "/."});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("scanned: is given twice, expected each session once"));
}

TEST(SealedSession, HasNothingWrittenOverByACloud) {
  const fs::path session = copied();
  const std::string recorded = read_text(session / "frames.csv");
  fs::create_directory_symlink(session, scratch_folder() / "link");
  for (const fs::path& out : {session / "box.ply", session / "frames/mono/x.ply", session / "clouds/laser.ply",
                              scratch_folder() / "link/x.ply"}) {
    const ProgramRun run = run_tankrig({"reconstruct", session.string(), "--out", out.string()});
    EXPECT_EQ(run.exit_code, 1) << out;
    EXPECT_THAT(run.err, HasSubstr("lies in the session")) << out;
  }
  EXPECT_THAT(compare_checksums(session), testing::IsEmpty());
}

TEST(SealedSession, WhosePictureIsGoneNamesTheCure) {
  const fs::path session = copied();
  fs::remove(session / "frames/mono/000002.png");
  for (const char* command : {"reconstruct", "report"}) {
    const ProgramRun run = run_tankrig({command, session.string()});
    EXPECT_EQ(run.exit_code, 1);
    EXPECT_THAT(run.err, HasSubstr("a session of what is left: tankrig session recover " + session.string()));
  }
}

TEST(SessionCheck, TellsAnExtraFileFromALossAndWhatIsMissing) {
  const fs::path session = copied();
  write_text(session / "diary.txt", "mine");
  ProgramRun run = run_tankrig({"session", "check", session.string()});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.out, HasSubstr("extra: diary.txt: not listed in SHA256SUMS"));
  EXPECT_THAT(run.out, Not(HasSubstr("lost")));
  fs::remove(session / "session.yaml");
  fs::remove(session / "rig.yaml");
  run = run_tankrig({"session", "check", session.string()});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.out, HasSubstr("missing: cameras and calibration, which neither session.yaml nor rig.yaml tells"));
}

TEST(Scan, OfARigWithAPathForANameStaysBelowSessions) {
  const fs::path folder = scratch_folder() / "deep/work", rig = small_rig(scratch_folder() / "rig");
  edit(rig, {{"name: \"rig\"", "name: ../../astray"}});
  fs::create_directories(folder);
  ASSERT_EQ(std::system(("cd '" + folder.string() + "' && " + TANKRIG_PROGRAM + " scan --rig '" + rig.string() +
                         "' >/dev/null 2>&1")
                            .c_str()),
            0);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
  ASSERT_TRUE(fs::is_directory(folder / "sessions"));
  EXPECT_THAT(fs::directory_iterator(folder / "sessions")->path().filename().string(),
              testing::StartsWith("_._.._astray-"));
  EXPECT_FALSE(fs::exists(scratch_folder() / "deep/astray"));
}

}  // namespace
}  // namespace tankrig::test
