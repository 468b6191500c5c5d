// What the session commands say and do when a session is cut, altered, oddly named, or the disk is full.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "core/text_files.hpp"
#include "session/reading/session.hpp"
#include "session/reading/session_yaml.hpp"
#include "tests/program/scanned_session.hpp"

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;

namespace tankrig::test {
namespace {

std::vector<std::string> files_below(const fs::path& folder) {
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  return files;
}

std::string calibration_of(const fs::path& session) {
  return recorded_calibration(read_text(session / "session.yaml"));
}

/// The program run by a shell that has done `first`; its exit code, as the shell tells it.
int shell(const std::string& first, const std::string& arguments, const fs::path& err = "/dev/null") {
  const int status = std::system(
      (first + " exec " + TANKRIG_PROGRAM + " " + arguments + " >/dev/null 2>'" + err.string() + "'").c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

TEST(SessionRecover, GivesAScanItsRecordedCalibrationBack) {
  const fs::path session = copied();
  const std::string yaml = read_text(session / "session.yaml"), recorded = calibration_of(session);
  const auto recovered = [&](const std::string& damaged) {
    write_text(session / "session.yaml", damaged);
    const ProgramRun run = run_tankrig({"session", "recover", session.string(), "--json"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(calibration_of(session), recorded);
    EXPECT_EQ(run_tankrig({"session", "check", session.string()}).exit_code, 0);
    EXPECT_THAT(Session::open(session).warnings, testing::IsEmpty());
    return run.json().at("losses").get<std::vector<std::string>>();
  };
  std::string edited = yaml;
  const std::size_t fx = edited.find("fx_px: ") + 7;
  edited.replace(fx, edited.find(',', fx) - fx, "865.4");
  ASSERT_NE(edited, yaml);
  EXPECT_THAT(recovered(edited), Contains(HasSubstr("its SHA-256 is right")));
  EXPECT_THAT(recovered(yaml.substr(0, yaml.find("\ncameras:") + 60)), Contains(HasSubstr("its SHA-256 is right")));
}

TEST(SessionExport, SaysWhatIsMissingAndIsPartial) {
  const fs::path session = copied(), out = scratch_folder() / "out";
  const std::string joints = read_text(session / "joints.csv");
  write_text(session / "joints.csv", joints.substr(0, joints.size() / 2));
  const std::vector<std::string> exported{"session", "export", session.string(), "--format",
                                          "csv",     "--out",  out.string()};
  ProgramRun run = run_tankrig(exported);
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_THAT(run.err, HasSubstr("joints.csv: its last line is incomplete"));
  EXPECT_THAT(run.err, testing::ContainsRegex("joints.csv: [0-9]+ of [0-9]+ lines there"));
  EXPECT_THAT(run.err, HasSubstr("joints.csv: changed since the session was sealed"));
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"session", "info"}, {"calibrate", "time"}, {"session", "replay"}}) {
    std::vector<std::string> line = command;
    line.push_back(session.string());
    EXPECT_THAT(run_tankrig(line).err, HasSubstr("joints.csv: its last line is incomplete")) << command.back();
  }
  fs::remove(session / "joints.csv");
  fs::remove_all(out);
  run = run_tankrig(exported);
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("joints.csv: missing"));
  EXPECT_TRUE(fs::exists(out / "csv/frames.csv"));
}

TEST(SessionExport, StandsBesideTheSessionHoweverThatIsWritten) {
  const fs::path session = copied(), beside = session.string() + "-export";
  const std::vector<std::string> before = files_below(session);
  EXPECT_EQ(run_tankrig({"session", "export", session.string() + "/", "--format", "csv"}).exit_code, 0);
  EXPECT_TRUE(fs::exists(beside / "csv/frames.csv"));
  fs::remove_all(beside);
  EXPECT_EQ(shell("cd '" + session.string() + "' &&", "session export . --format csv"), 0);
  EXPECT_TRUE(fs::exists(beside / "csv/frames.csv"));
  EXPECT_EQ(files_below(session), before);
}

TEST(SessionCommands, WriteNothingIntoTheSessionTheyRead) {
  const fs::path session = copied();
  const std::vector<std::string> before = files_below(session);
  for (const char* command : {"export", "replay", "recover"}) {
    std::vector<std::string> line{"session", command, session.string() + "/", "--out", (session / "inside").string()};
    if (line[1] == "export") line.insert(line.end(), {"--format", "csv"});
    const ProgramRun run = run_tankrig(line);
    EXPECT_EQ(run.exit_code, 1) << command;
    EXPECT_THAT(run.err, HasSubstr("inside: lies in the session")) << command;
  }
  EXPECT_EQ(files_below(session), before);
}

TEST(SessionReplay, WantsFramesInTheSpoolRecoveredFirst) {
  const fs::path session = copied();
  fs::create_directory(session / "spool");
  write_text(session / "spool/000000.raw", "TANKFRM1");
  const ProgramRun run = run_tankrig({"session", "replay", session.string()});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("tankrig session recover it first"));
  EXPECT_EQ(run.err.find("File exists"), std::string::npos) << run.err;
}

TEST(SessionExport, BagThatFindsNoRoomIsOneLineAndLeavesNothing) {
  const fs::path out = scratch_folder() / "out", err = scratch_folder() / "err.txt";
  for (const char* blocks : {"4", "1000"}) {  // of 512 bytes: none for its first record, none for its last
    const int code =
        shell(std::string("ulimit -f ") + blocks + ";",
              "session export '" + scanned().string() + "' --format bag --out '" + out.string() + "'", err);
    const std::string said = read_text(err);
    if (said.find("built without librosbag-storage") != std::string::npos) GTEST_SKIP() << said;
    EXPECT_EQ(code, 1) << said;
    EXPECT_THAT(said, HasSubstr("scanned.bag.tmp: cannot be written: "));
    EXPECT_TRUE(fs::is_empty(out)) << "no bag, and no part of one";
  }
}

TEST(SessionExport, MakesItsFolderOnlyWhereThisBuildCanWriteIntoIt) {
  const fs::path out = scratch_folder() / "out";
  const ProgramRun run =
      run_tankrig({"session", "export", scanned().string(), "--format", "bag", "--out", out.string()});
  EXPECT_EQ(fs::exists(out), run.exit_code == 0) << run.err;
}

}  // namespace
}  // namespace tankrig::test
