// The command line: help, plans, bad input and interruption, as a user meets them.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>

#include "session/reading/session.hpp"
#include "tests/program/program.hpp"

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

namespace tankrig::test {
namespace {

/// One line on standard error (warnings aside), exit code 1, nothing at `forbidden`.
void expect_refusal(const ProgramRun& run, const std::vector<std::string>& words, const fs::path& forbidden = {}) {
  EXPECT_EQ(run.exit_code, 1) << run.err;
  std::istringstream lines(run.err);
  int refusals = 0;
  for (std::string line; std::getline(lines, line);) refusals += line.find("warning:") == std::string::npos;
  EXPECT_EQ(refusals, 1) << run.err;
  for (const std::string& word : words) EXPECT_THAT(run.err, HasSubstr(word));
  EXPECT_FALSE(!forbidden.empty() && fs::exists(forbidden)) << forbidden;
}

TEST(Help, EveryCommandExplainsItselfWithAnExample) {
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{{},
                                                                                       {"scan"},
                                                                                       {"reconstruct"},
                                                                                       {"evaluate"},
                                                                                       {"cloud"},
                                                                                       {"cloud", "convert"},
                                                                                       {"cloud", "crop"},
                                                                                       {"cloud", "voxel"},
                                                                                       {"cloud", "normals"},
                                                                                       {"cloud", "outliers"},
                                                                                       {"cloud", "floor"},
                                                                                       {"cloud", "align"},
                                                                                       {"cloud", "mesh"},
                                                                                       {"cloud", "merge"},
                                                                                       {"session"},
                                                                                       {"session", "import"},
                                                                                       {"session", "info"},
                                                                                       {"session", "check"},
                                                                                       {"session", "recover"},
                                                                                       {"session", "replay"},
                                                                                       {"session", "export"},
                                                                                       {"calibrate"},
                                                                                       {"calibrate", "camera"},
                                                                                       {"calibrate", "stereo"},
                                                                                       {"calibrate", "object"},
                                                                                       {"calibrate", "convert"},
                                                                                       {"calibrate", "laser"},
                                                                                       {"calibrate", "time"},
                                                                                       {"budget"},
                                                                                       {"doctor"},
                                                                                       {"emulate"},
                                                                                       {"guardian"},
                                                                                       {"report"},
                                                                                       {"completion"},
                                                                                       {"manual"},
                                                                                       {"init"}}) {
    std::vector<std::string> arguments = command;
    arguments.push_back("--help");
    const ProgramRun run = run_tankrig(arguments);
    EXPECT_EQ(run.exit_code, 0);
    EXPECT_THAT(run.out, HasSubstr("Example: tankrig"));
  }
}

/// What a line of the shell prints.
std::string printed_by(const std::string& line) {
  FILE* pipe = popen(line.c_str(), "r");
  std::string out;
  for (char buffer[4096]; const std::size_t n = std::fread(buffer, 1, sizeof buffer, pipe);) out.append(buffer, n);
  EXPECT_EQ(pclose(pipe), 0) << line;
  return out;
}

TEST(Help, OfTheSmallerTankrigThatRunBuildsFirstIsTheSame) {
  std::istringstream lines(read_text(fs::path(TANKRIG_SOURCE_DIR) / "run"));
  std::string line;
  while (std::getline(lines, line) && line.find("scan_commands.cpp") == std::string::npos) {
  }
  std::istringstream commands(line.substr(0, line.find(')')));
  int compared = 0;
  for (std::string command; commands >> command;) {
    if (command == "|") continue;
    const auto help = [&](const fs::path& program) {
      return printed_by("PATH=" + program.parent_path().string() + ":$PATH tankrig " + command + " --help");
    };
    EXPECT_EQ(help(TANKRIG_SCAN_PROGRAM), help(TANKRIG_PROGRAM));
    ++compared;
  }
  EXPECT_GT(compared, 1);
}

/// What bash offers where `words`, the last one unfinished, stand on its command line.
std::string offered_by_bash(const std::vector<std::string>& words) {
  const fs::path script = scratch_folder() / "complete.bash";
  std::string text = run_tankrig({"completion", "bash"}).out + "\nCOMP_WORDS=(";
  for (const std::string& word : words) text += "'" + word + "' ";
  write_text(script,
             text + ")\nCOMP_CWORD=" + std::to_string(words.size() - 1) + "\n_tankrig\necho \"${COMPREPLY[*]}\"\n");
  return printed_by("bash " + script.string());
}

TEST(Completion, OffersCommandsOptionsAndValuesAndLeavesTheRestToFiles) {
  EXPECT_EQ(offered_by_bash({"tankrig", "sc"}), "scan\n");
  EXPECT_EQ(offered_by_bash({"tankrig", "session", "re"}), "recover replay\n");
  EXPECT_EQ(offered_by_bash({"tankrig", "scan", "--pr"}), "--preset\n");
  EXPECT_EQ(offered_by_bash({"tankrig", "scan", "--json", "--carrier", ""}), "can serial\n");
  EXPECT_EQ(offered_by_bash({"tankrig", "init", "--k"}), "--keys\n") << "of an option group";
  EXPECT_EQ(offered_by_bash({"tankrig", "arm", "jog", "el"}), "elbow\n");
  EXPECT_EQ(offered_by_bash({"tankrig", "scan", "--faults", ""}), "\n");
  EXPECT_EQ(offered_by_bash({"tankrig", "session", "info", ""}), "\n");
}

TEST(Manual, HasEveryCommandWithItsOptions) {
  const fs::path page = scratch_folder() / "tankrig.1";
  write_text(page, run_tankrig({"manual"}).out);
  for (const char* command : {"tankrig scan", "tankrig session info", "tankrig arm jog", "tankrig calibrate time"})
    EXPECT_THAT(read_text(page), HasSubstr(".SS " + std::string(command) + "\n"));
  EXPECT_THAT(read_text(page), HasSubstr("\n.TP\n\\fB\\-\\-particles\\fR"));
}

TEST(Usage, WrongWordsAreExitCodeTwo) {
  EXPECT_EQ(run_tankrig({}).exit_code, 2);
  EXPECT_EQ(run_tankrig({"sacn"}).exit_code, 2);
  EXPECT_EQ(run_tankrig({"scan", "--light", "7"}).exit_code, 2);
  EXPECT_EQ(run_tankrig({"reconstruct", "x", "--method", "magic"}).exit_code, 2);
}

TEST(Usage, AWordThatIsNoCommandIsNamedBesideThoseThatAre) {
  const std::pair<std::vector<std::string>, std::vector<std::string>> wrong[] = {
      {{"sacn"}, {"tankrig: found 'sacn'", "scan, bench, experiment, reconstruct"}},
      {{"session", "inof"}, {"tankrig session: found 'inof'", "info, list, check"}},
      {{"arm", "raise"}, {"tankrig arm: found 'raise'", "status, stop, jog, park, home"}}};
  for (const auto& [words, expected] : wrong) {
    const ProgramRun run = run_tankrig(words);
    EXPECT_EQ(run.exit_code, 2);
    for (const std::string& text : expected) EXPECT_THAT(run.err, HasSubstr(text));
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  }
}

TEST(Usage, AnOptionThatIsWrongOrMissingIsNamed) {
  const std::pair<std::vector<std::string>, std::string> wrong[] = {
      {{"evaluate", "c.ply", "--objcet", "box.obj", "--pose", "pose.yaml"}, "not expected: --objcet"},
      {{"evaluate", "c.ply", "d.ply", "--object", "box.obj"}, "--pose is required"},
      {{"scan", "--noise", "7"}, "--noise: found '7', expected a number from 0 to 0.1"},
      {{"scan", "--noise", "loud"}, "--noise: found 'loud', expected a number from 0 to 0.1"},
      {{"session", "info", "--jsno"}, "not expected: --jsno"},
      {{"session", "info"}, "session is required"},
      {{"session", "export", "s"}, "is required"},
      {{"session", "--jsno"}, "not expected: --jsno"},
      {{"--jsno"}, "not expected: --jsno"}};
  for (const auto& [words, expected] : wrong) {
    const ProgramRun run = run_tankrig(words);
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_THAT(run.err, HasSubstr(expected)) << testing::PrintToString(words);
    EXPECT_THAT(run.err, Not(HasSubstr("one of: \n"))) << run.err;
  }
}

TEST(Init, TakesNothingInItsWayAndANameWithASlash) {
  const fs::path rig = scratch_folder() / "place/my-rig", diary = scratch_folder() / "place/my-rig.tmp/diary";
  fs::create_directories(diary.parent_path());
  write_text(diary, "mine");
  const ProgramRun run = run_tankrig({"init", rig.string() + "/"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(read_text(diary), "mine");
  EXPECT_THAT(read_text(rig / "rig.yaml"), HasSubstr("\nname: \"my-rig\""));
  EXPECT_EQ(std::distance(fs::directory_iterator(scratch_folder() / "place"), fs::directory_iterator()), 2);
}

TEST(Init, PrintsTheKeysThatTheReferenceHas) {
  const ProgramRun run = run_tankrig({"init", "--keys"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(read_text(fs::path(TANKRIG_SOURCE_DIR) / "docs/reference/rig_keys.md").ends_with("\n\n" + run.out))
      << "docs/reference/rig_keys.md: put the output of `tankrig init --keys` below its first paragraph";
}

TEST(SessionList, NamesWhatIsNoSessionAnyMore) {
  const fs::path folder = scratch_folder() / "sessions";
  fs::create_directories(folder / "broken");
  fs::create_directories(folder / "empty");
  write_text(folder / "broken/session.yaml", "format: [\n");
  write_text(folder / "notes.txt", "no session");
  const ProgramRun run = run_tankrig({"session", "list", folder.string(), "--json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  ASSERT_EQ(run.json().size(), 1u) << run.out;
  EXPECT_EQ(run.json()[0].at("session"), (folder / "broken").string());
  EXPECT_THAT(run.json()[0].at("failure").get<std::string>(), HasSubstr("session.yaml"));
  expect_refusal(run_tankrig({"session", "list", (folder / "gone").string()}),
                 {"gone", "expected a folder of sessions"});
}

TEST(Init, CopiesARigWithAllThatItIsBasedOn) {
  for (const char* of : {"tank-sim", "tank-true", "tank-true-wire"}) {
    const fs::path rig = scratch_folder() / of;
    ASSERT_EQ(run_tankrig({"init", rig.string(), "--from", of}).exit_code, 0);
    const ProgramRun run = run_tankrig({"scan", "--rig", (rig / "rig.yaml").string(), "--dry-run"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
  }
}

TEST(DryRun, NeedsNoDevice) {
  const fs::path rig = scratch_folder() / "rig";
  ASSERT_EQ(run_tankrig({"init", rig.string(), "--from", "tank-wire"}).exit_code, 0);
  const std::string text = read_text(rig / "rig.yaml");
  write_text(rig / "rig.yaml", text.substr(0, text.find("\nemulation:") + 1));  // real ones, and none is there
  const ProgramRun run = run_tankrig({"scan", "--rig", (rig / "rig.yaml").string(), "--dry-run"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("clearance"));
}

/// What a killed emulation left goes with the next one; a folder whose owner lives stays.
TEST(Emulate, RemovesTheFoldersOfTheDeadAndNoOthers) {
  const fs::path place = scratch_folder() / "tmp", dead = place / "tankrig-runtime-dead00",
                 owned = place / "tankrig-runtime-owned0", foreign = place / "tankrig-notes",
                 unnamed = place / ".tankrig-runtime-dead00", young = place / ".tankrig-runtime-young0";
  for (const fs::path& folder : {dead, owned, foreign, unnamed, young}) fs::create_directories(folder);
  fs::last_write_time(unnamed, fs::file_time_type::clock::now() - std::chrono::hours(1));
  write_text(dead / "laser", "");
  const int owner = ::open(owned.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  ASSERT_EQ(::flock(owner, LOCK_EX | LOCK_NB), 0);
  ::setenv("TMPDIR", place.c_str(), 1);
  const ProgramRun run = run_tankrig({"emulate", "--rig", "tank-wire", "--device", "laser", "--", "true"});
  ::unsetenv("TMPDIR");
  ::close(owner);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_FALSE(fs::exists(dead));
  EXPECT_FALSE(fs::exists(unnamed)) << "killed before it had its lock";
  EXPECT_TRUE(fs::exists(young)) << "about to get it";
  EXPECT_TRUE(fs::exists(owned));
  EXPECT_TRUE(fs::exists(foreign));
  for (const auto& entry : fs::directory_iterator(place))
    if (entry.path() != young && entry.path().filename().string().find("tankrig-runtime-") != std::string::npos) {
      EXPECT_EQ(entry.path(), owned) << "its own is gone";
    }
}

TEST(DryRun, PrintsPathClearanceDurationDiskAndTheFacesInView) {
  const ProgramRun run = run_tankrig({"scan", "--dry-run", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto plan = run.json();
  EXPECT_GT(plan.at("duration_s").get<double>(), 10);
  EXPECT_GT(plan.at("clearance_m").get<double>(), 0.02);
  EXPECT_GT(plan.at("disk_bytes").get<double>(), 1e6);
  std::vector<std::string> kinds;
  for (const auto& nearest : plan.at("clearances")) {
    kinds.push_back(nearest.at("kind"));
    EXPECT_GE(nearest.at("clearance_m"), plan.at("clearance_m")) << nearest.dump();
    EXPECT_EQ(nearest.at("posture_rad").size(), 5u);
  }
  EXPECT_THAT(kinds, testing::ElementsAre("object", "floor and walls", "cameras", "frame", "arm itself"));
  int good = 0;
  for (const auto& face : plan.at("faces"))
    good += face.at("seen") > 0.99 && face.at("lit") > 0.99 && face.at("camera_incidence_deg") <= 70 &&
            face.at("laser_incidence_deg") <= 70;
  EXPECT_EQ(good, 3) << plan.at("faces").dump(1);
}

TEST(DryRun, DrawsTheArmFromParkAlongThePathWithItsClearance) {
  const ProgramRun run = run_tankrig({"scan", "--dry-run", "--json", "--draw"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto plan = run.json();
  const auto& drawing = plan.at("drawing");
  EXPECT_EQ(drawing.at("cameras").size(), 3U);
  EXPECT_GE(drawing.at("object").at("vertices").size(), 8U);
  EXPECT_EQ(drawing.at("tank").size(), 8U);
  const auto& poses = drawing.at("poses");
  ASSERT_GT(poses.size(), 100U);
  EXPECT_EQ(poses.front().at("t_s"), 0);
  EXPECT_NEAR(poses.back().at("t_s").get<double>(), plan.at("duration_s").get<double>(), 1e-3);
  int lit = 0;
  for (const auto& pose : poses) {
    EXPECT_EQ(pose.at("arm").size(), 5U);
    EXPECT_EQ(pose.at("sheet").size(), 3U);
    EXPECT_GE(pose.at("clearance_m").get<double>(), plan.at("clearance_m").get<double>() - 1e-3) << pose.dump();
    lit += pose.at("laser").get<bool>();
  }
  EXPECT_GT(lit, 20);
  const auto& nearest = drawing.at("nearest");
  EXPECT_EQ(nearest.at("pair"), plan.at("nearest"));
  const auto point = [&](int i) {
    const auto p = nearest.at("points").at(i).get<std::vector<double>>();
    return Vector3d(p.at(0), p.at(1), p.at(2));
  };
  EXPECT_NEAR((point(0) - point(1)).norm(), plan.at("clearance_m").get<double>(), 1e-3) << nearest.dump();
  EXPECT_EQ(run_tankrig({"scan", "--dry-run", "--draw"}).exit_code, 2) << "drawn without --json";
}

TEST(DryRun, EveryShippedRigHasASafePlan) {
  for (const auto& rig : fs::directory_iterator(fs::path(TANKRIG_SOURCE_DIR) / "etc/rigs")) {
    const ProgramRun run = run_tankrig({"scan", "--rig", rig.path().filename().string(), "--dry-run"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(run.out, HasSubstr("clearance"));
  }
}

TEST(BadInput, ARigThatIsNotThereNamesThoseThatAre) {
  expect_refusal(run_tankrig({"scan", "--rig", "atlantis"}), {"atlantis", "tank-sim"});
}

TEST(BadInput, AnUnknownKeyIsNamedWithFileAndLine) {
  const fs::path rig = edited_rig(scratch_folder() / "rig", "\nbackend: mock", "\nbackand: mock");
  expect_refusal(run_tankrig({"scan", "--rig", rig.string()}), {"rig.yaml:", "backand"});
}

TEST(BadInput, AValueOutOfRangeIsNamedWithWhatWasExpected) {
  const fs::path rig = edited_rig(scratch_folder() / "rig", "cycle_hz: 200", "cycle_hz: -5");
  expect_refusal(run_tankrig({"scan", "--rig", rig.string()}), {"rig.yaml:", "cycle_hz", "'-5'", "expected a number"});
}

TEST(BadInput, AnUnknownReconstructionKeyStopsTheScanBeforeItBegins) {
  const fs::path rig = edited_rig(scratch_folder() / "rig", "value_min: 154", "value_mni: 154");
  const fs::path out = scratch_folder() / "session";
  expect_refusal(run_tankrig({"scan", "--rig", rig.string(), "--out", out.string()}), {"rig.yaml:", "value_mni"}, out);
}

TEST(BadInput, ABrokenSceneIsNamedWithItsLine) {
  const fs::path rig = edited_rig(scratch_folder() / "rig", "backend: mock", "backend: mock");
  const fs::path scene = rig.parent_path() / "tank.xml";
  std::string text = read_text(scene);
  text.replace(text.find("<lightRate>1.0"), 14, "<lightRate>one");
  write_text(scene, text);
  const fs::path out = scratch_folder() / "session";
  expect_refusal(run_tankrig({"scan", "--rig", rig.string(), "--out", out.string()}), {"tank.xml:", "lightRate", "one"},
                 out);
}

TEST(BadInput, AMissingMeshIsNamed) {
  const fs::path rig = edited_rig(scratch_folder() / "rig", "mesh: black_box.obj", "mesh: white_box.obj");
  const fs::path out = scratch_folder() / "session";
  expect_refusal(run_tankrig({"scan", "--rig", rig.string(), "--out", out.string()}), {"white_box.obj"}, out);
}

TEST(BadInput, AMotionBeyondALimitIsRefusedBeforeAnythingMoves) {
  const fs::path rig = edited_rig(scratch_folder() / "rig", "to_rad: 2.1", "to_rad: 2.15");
  const fs::path out = scratch_folder() / "session";
  expect_refusal(run_tankrig({"scan", "--rig", rig.string(), "--out", out.string()}), {"elbow"}, out);
}

TEST(BadInput, AMotionThroughTheBoxIsRefusedBeforeAnythingMoves) {
  const fs::path rig = edited_rig(scratch_folder() / "rig", "bMo: {translation_m: [-0.26, 0.025, 1.02]",
                                  "bMo: {translation_m: [0.45, 0.0, 0.6]");
  const fs::path out = scratch_folder() / "session";
  expect_refusal(run_tankrig({"scan", "--rig", rig.string(), "--out", out.string()}), {"object", "comes within"}, out);
}

TEST(Warnings, ARigThatIsNotCalibratedToItsSceneIsTold) {
  const fs::path rig = edited_rig(scratch_folder() / "rig", "bMc: {translation_m: [0.716, 0.228, 0.585]",
                                  "bMc: {translation_m: [0.741, 0.228, 0.585]");
  const ProgramRun run = run_tankrig({"scan", "--rig", rig.string(), "--dry-run"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.err, HasSubstr("camera mono stands 25.0 mm"));
  EXPECT_THAT(run_tankrig({"scan", "--dry-run"}).err, Not(HasSubstr("warning")));
}

TEST(Warnings, AnObjectThatIsNotTheScenesIsTold) {
  const fs::path rig = edited_rig(scratch_folder() / "rig", "mesh: black_box.obj", "mesh: other_box.obj");
  write_text(rig.parent_path() / "other_box.obj", read_text(rig.parent_path() / "black_box.obj") + "# mine\n");
  const ProgramRun run = run_tankrig({"scan", "--rig", rig.string(), "--dry-run"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("other_box.obj is another mesh than the scene's black_box.obj"));
}

TEST(BadInput, ASessionDirectoryInUseIsLeftAlone) {
  const fs::path out = scratch_folder() / "session";
  fs::create_directories(out);
  write_text(out / "diary.txt", "mine");
  const ProgramRun run = run_tankrig({"scan", "--out", out.string()});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("exists already"));
  EXPECT_EQ(read_text(out / "diary.txt"), "mine");
}

TEST(BadInput, LuxThatIsNoNumberIsRefused) {
  expect_refusal(run_tankrig({"scan", "--lux", "bright"}), {"--lux", "bright", "auto"});
  expect_refusal(run_tankrig({"scan", "--lux", "1.1e7"}), {"--lux", "1.1e7", "from 0 to 10000000"});
}

TEST(BadInput, ACloudThatIsCutShortIsNamedWithItsCounts) {
  const fs::path folder = scratch_folder();
  write_text(folder / "cloud.ply",
             "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
             "z\nend_header\n0 0 0\n1 1 1\n");
  write_text(folder / "pose.yaml", "translation_m: [0, 0, 0]\nquaternion_xyzw: [0, 0, 0, 1]\n");
  const std::string mesh = (fs::path(TANKRIG_SOURCE_DIR) / "etc/objects/black_box.obj").string();
  expect_refusal(run_tankrig({"evaluate", (folder / "cloud.ply").string(), "--object", mesh, "--pose",
                              (folder / "pose.yaml").string()}),
                 {"cloud.ply", "2", "3"});
}

TEST(BadInput, APoseWithoutAQuaternionIsNamedWithItsField) {
  const fs::path folder = scratch_folder();
  write_text(folder / "cloud.ply",
             "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
             "z\nend_header\n0 0 0\n");
  write_text(folder / "pose.yaml", "translation_m: [0, 0, 0]\n");
  const std::string mesh = (fs::path(TANKRIG_SOURCE_DIR) / "etc/objects/black_box.obj").string();
  expect_refusal(run_tankrig({"evaluate", (folder / "cloud.ply").string(), "--object", mesh, "--pose",
                              (folder / "pose.yaml").string()}),
                 {"pose.yaml", "quaternion_xyzw"});
}

TEST(BadInput, ASessionThatIsNotThereIsNamed) {
  expect_refusal(run_tankrig({"reconstruct", "/nonexistent/session"}), {"/nonexistent/session"});
  expect_refusal(run_tankrig({"session", "info", "/nonexistent/session"}), {"/nonexistent/session"});
}

TEST(BadInput, ImportNeedsOneKindOfPlaneAndLeavesNothingBehind) {
  const fs::path out = scratch_folder() / "imported";
  expect_refusal(
      run_tankrig({"session", "import", "--images", "/nonexistent", "--camera", "x.yaml", "--out", out.string()}),
      {"--plane", "--planes"}, out);
}

TEST(Evaluate, APerfectTopFaceScoresItsShareOfTheSurface) {
  const fs::path folder = scratch_folder();
  std::string points;
  int count = 0;
  for (double x = -0.07; x <= 0.0701; x += 0.002)
    for (double y = -0.15; y <= 0.1501; y += 0.002, ++count)
      points += std::to_string(x) + " " + std::to_string(y) + " 1.5\n";
  write_text(folder / "cloud.ply", "ply\nformat ascii 1.0\nelement vertex " + std::to_string(count) +
                                       "\nproperty float x\nproperty float y\nproperty float z\nend_header\n" + points);
  write_text(folder / "pose.yaml", "translation_m: [0, 0, 1.5]\nquaternion_xyzw: [0, 0, 0, 1]\n");
  const std::string mesh = (fs::path(TANKRIG_SOURCE_DIR) / "etc/objects/black_box.obj").string();
  const ProgramRun run =
      run_tankrig({"evaluate", (folder / "cloud.ply").string(), "--object", mesh, "--pose",
                   (folder / "pose.yaml").string(), "--json", "--verdict", (folder / "verdict.ply").string()});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto score = run.json();
  EXPECT_NEAR(score.at("mean_error_m").get<double>(), 0, 1e-7);
  const double top_and_rims =
      (0.14 * 0.30 + 2 * 0.002 * (0.14 + 0.30)) / 0.2248;  // 2 mm of each side are that near to the top
  EXPECT_NEAR(score.at("coverage_at").at("0.002").get<double>(), top_and_rims, 0.003);
  EXPECT_TRUE(fs::exists(folder / "verdict.ply"));
}

TEST(Evaluate, TheReferenceModulesArithmeticNamesItsOddities) {
  const fs::path folder = scratch_folder();
  write_text(folder / "cloud.ply",
             "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
             "z\nend_header\n0 0 0\n");
  write_text(folder / "pose.yaml", "translation_m: [0, 0, 0]\nquaternion_xyzw: [0, 0, 0, 1]\n");
  const std::string mesh = (fs::path(TANKRIG_SOURCE_DIR) / "etc/objects/black_box.obj").string();
  const ProgramRun run = run_tankrig({"evaluate", (folder / "cloud.ply").string(), "--object", mesh, "--pose",
                                      (folder / "pose.yaml").string(), "--definition", "uwsim", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.json().at("definition"), "uwsim");
  EXPECT_FALSE(run.json().at("oddities").empty());
}

/// `evaluate` of a cloud of `points` against the black box at `translation`.
ProgramRun evaluated(const std::string& points, const std::string& translation, std::vector<std::string> more = {}) {
  const fs::path folder = scratch_folder();
  write_text(folder / "cloud.ply", "ply\nformat ascii 1.0\nelement vertex " +
                                       std::to_string(std::count(points.begin(), points.end(), '\n')) +
                                       "\nproperty float x\nproperty float y\nproperty float z\nend_header\n" + points);
  write_text(folder / "pose.yaml", "translation_m: " + translation + "\nquaternion_xyzw: [0, 0, 0, 1]\n");
  std::vector<std::string> words{"evaluate", (folder / "cloud.ply").string(),
                                 "--object", (fs::path(TANKRIG_SOURCE_DIR) / "etc/objects/black_box.obj").string(),
                                 "--pose",   (folder / "pose.yaml").string(),
                                 "--json"};
  words.insert(words.end(), more.begin(), more.end());
  return run_tankrig(words);
}

TEST(Evaluate, ACloudWithoutAPointOfTheObjectIsNoSuccess) {
  for (const std::string definition : {"paper", "uwsim"}) {
    const ProgramRun empty = evaluated("", "[0, 0, 0]", {"--definition", definition});
    EXPECT_EQ(empty.exit_code, 3) << empty.err;
    EXPECT_THAT(empty.err, HasSubstr("cloud.ply: empty cloud: it has no point: nothing to score"));
    EXPECT_EQ(empty.json().at("definition"), definition);
    const ProgramRun far = evaluated("0 0 3\n", "[0, 0, 0]", {"--definition", definition});
    EXPECT_EQ(far.exit_code, 3) << far.err;
    EXPECT_THAT(far.err, HasSubstr("no point is near the object"));
    EXPECT_THAT(far.err, HasSubstr("the file names none"));
    EXPECT_THAT(far.err, Not(HasSubstr("frame c")));
  }
  EXPECT_EQ(evaluated("0 0 0\n", "[0, 0, 0]").exit_code, 0);
}

TEST(Evaluate, AnEmptyCloudIsNamedWhateverItsNotation) {
  const fs::path folder = scratch_folder();
  write_text(folder / "pose.yaml", "translation_m: [0, 0, 0]\nquaternion_xyzw: [0, 0, 0, 1]\n");
  const auto ply = [](const std::string& format, int points) {
    return "ply\nformat " + format + " 1.0\nelement vertex " + std::to_string(points) +
           "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  };
  const auto pcd = [](const std::string& data) {
    return "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 0\nHEIGHT 1\n"
           "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 0\nDATA " +
           data + "\n";
  };
  const std::pair<const char*, std::string> clouds[] = {
      {"text.ply", ply("ascii", 0)},
      {"binary.ply", ply("binary_little_endian", 0)},
      {"text.pcd", pcd("ascii")},
      {"binary.pcd", pcd("binary")},
      {"compressed.pcd", pcd("binary_compressed")},
      {"sized.pcd", pcd("binary_compressed") + std::string(8, '\0')},
      {"nan.ply", ply("ascii", 1) + "nan 0 0\n"},
  };
  for (const auto& [name, text] : clouds) {
    write_text(folder / name, text);
    const ProgramRun run = run_tankrig({"evaluate", (folder / name).string(), "--object",
                                        (fs::path(TANKRIG_SOURCE_DIR) / "etc/objects/black_box.obj").string(), "--pose",
                                        (folder / "pose.yaml").string()});
    EXPECT_EQ(run.exit_code, 3) << name;
    EXPECT_THAT(run.err, HasSubstr(std::string(name) + ": empty cloud: ")) << name;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  }
}

TEST(Evaluate, CoverageIsGivenAtTheThresholdsThatAreAskedFor) {
  // The top face of the black box, 140 x 300 mm, as a lattice of 4 mm: nothing of it is farther than 2.83 mm away.
  std::string face;
  for (int x = -70; x <= 70; x += 4)
    for (int y = -150; y <= 150; y += 4) face += std::to_string(1e-3 * x) + " " + std::to_string(1e-3 * y) + " 0\n";
  const nlohmann::json usual = evaluated(face, "[0, 0, 0]").json();
  EXPECT_EQ(usual.at("thresholds").at("coverage_m"), (std::vector<double>{0.002, 0.005, 0.010}));
  const nlohmann::json asked = evaluated(face, "[0, 0, 0]", {"--coverage", "1,3.5,5"}).json();
  EXPECT_EQ(asked.at("thresholds").at("coverage_m"), (std::vector<double>{0.001, 0.0035, 0.005, 0.010}))
      << "with the headline's";
  EXPECT_EQ(asked.at("coverage"), usual.at("coverage")) << "the headline is as it was";
  EXPECT_EQ(asked.at("coverage_at").at("0.005"), usual.at("coverage_at").at("0.005"));
  constexpr double kTop = 0.14 * 0.3 / 0.2248;
  EXPECT_NEAR(asked.at("coverage_at").at("0.001").get<double>(), kTop * 3.1416 / 16, 0.05 * kTop);
  EXPECT_NEAR(asked.at("coverage_at").at("0.0035").get<double>(), kTop, 0.1 * kTop);
  std::vector<std::string> words{"evaluate", (scratch_folder() / "cloud.ply").string(),
                                 "--object", (fs::path(TANKRIG_SOURCE_DIR) / "etc/objects/black_box.obj").string(),
                                 "--pose",   (scratch_folder() / "pose.yaml").string()};
  EXPECT_THAT(run_tankrig(words).out, Not(HasSubstr("coverage at")));
  words.insert(words.end(), {"--coverage", "1,3.5,5"});
  EXPECT_THAT(run_tankrig(words).out, testing::ContainsRegex("coverage at +1 mm +3.5 mm +5 mm +10 mm\ncloud  "));
}

TEST(Evaluate, ABadThresholdOfCoverageIsAWrongCommandLine) {
  for (const char* bad : {"", "0", "-1", "2,", "2,two", "nan", "inf", "0.002,0.005", "1001", "2,2", "2;5", "2 5"}) {
    const ProgramRun run = evaluated("0 0 0\n", "[0, 0, 0]", {"--coverage", bad});
    EXPECT_EQ(run.exit_code, 2) << "'" << bad << "'";
    EXPECT_THAT(run.err, HasSubstr("--coverage: found '")) << bad;
  }
  for (const char* command : {"evaluate", "report", "scan"})
    EXPECT_THAT(run_tankrig({command, "--help"}).out, HasSubstr("Thresholds of coverage [mm], as 1,2,5,10")) << command;
  EXPECT_THAT(evaluated("0 0 0\n", "[0, 0, 0]", {"--coverage", "2", "--definition", "uwsim"}).err,
              HasSubstr("--coverage, --ground and --ground-plane belong to --definition paper"));
}

TEST(Evaluate, APoseInMillimetresIsQuestioned) {
  expect_refusal(evaluated("0 0 0\n", "[0, 0, 1500]"),
                 {"pose.yaml:1: translation_m: found '1500'", "looks like millimetres, expected metres"});
}

TEST(Interruption, CtrlCLeavesTheLaserOffTheArmAtRestAndTheSessionReadable) {
  const fs::path out = scratch_folder() / "session";
  bool sent = false;
  const ProgramRun run = run_tankrig({"scan", "--out", out.string()}, [&](const std::string& line, int pid) {
    if (!sent && line.find("sweep") != std::string::npos && line.find("move") == std::string::npos)
      sent = kill(pid, SIGINT) == 0;
  });
  ASSERT_TRUE(sent) << run.err;
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_THAT(run.err, HasSubstr("laser off, arm at rest"));
  const Session session = Session::open(out);
  EXPECT_THAT(session.info.status, testing::StartsWith("stopped"));
  EXPECT_FALSE(session.frames.empty());
  const std::string events = read_text(out / "events.csv");
  const std::size_t on = events.rfind(",laser,on"), off = events.rfind(",laser,off"),
                    dark = events.rfind(",laser,dark");
  ASSERT_NE(on, std::string::npos) << events;
  EXPECT_GT(off, on) << events;    // the last command to the laser
  EXPECT_GT(dark, off) << events;  // and what it then reported
  std::istringstream rows(read_text(out / "joints.csv"));
  std::string row, last;
  while (std::getline(rows, row)) last = row;
  // stamp_ns, five joints, five velocities [rad/s]: the elbow's is the eighth of the numbers after the stamp.
  std::vector<std::string> fields;
  for (std::istringstream cells(last); std::getline(cells, row, ',');) fields.push_back(row);
  ASSERT_GT(fields.size(), 8u) << last;
  EXPECT_NEAR(std::stod(fields[8]), 0, 0.01) << last;
}

}  // namespace
}  // namespace tankrig::test
