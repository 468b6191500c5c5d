// What the program says and does on a disk without room: a file system of its own for every case.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "session/checking/checksums.hpp"
#include "tests/program/program.hpp"
#include "tests/session/some_session.hpp"

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

namespace tankrig::test {
namespace {

/// Commands of a shell whose `disk` folder is a file system of so many MiB, seen by them only. `$tankrig` is the
/// program.
struct SmallDisk {
  fs::path disk = scratch_folder() / "disk", out = scratch_folder() / "out.txt", err = scratch_folder() / "err.txt";
  int megabytes;

  explicit SmallDisk(int size) : megabytes(size) { fs::create_directories(disk); }

  int run(const std::string& commands) const {
    const fs::path script = scratch_folder() / "script.sh";
    write_text(script, "mount -t tmpfs -o size=" + std::to_string(megabytes) + "m small '" + disk.string() +
                           "' || exit 77\ntankrig='" TANKRIG_PROGRAM "' disk='" + disk.string() +
                           "'\ncd '" TANKRIG_SOURCE_DIR "'\n" + commands);
    const std::string own = ::geteuid() == 0 ? "unshare -m" : "unshare -rm";
    const int status =
        std::system((own + " sh '" + script.string() + "' >'" + out.string() + "' 2>'" + err.string() + "'").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  std::string said() const { return read_text(err); }
};

bool no_mounts() {
  static const bool none = SmallDisk(1).run("true") != 0;
  return none;
}

#define SKIP_WITHOUT_MOUNTS() \
  if (no_mounts()) GTEST_SKIP() << "this machine permits no mount of one's own"

TEST(SmallDisk, RefusesAScanInOneLineBeforeAnythingMoves) {
  SKIP_WITHOUT_MOUNTS();
  const SmallDisk small(20);
  EXPECT_EQ(small.run("$tankrig scan --out \"$disk/sessions/monday\"; code=$?; ls -A \"$disk\"; exit $code"), 1);
  const std::string said = small.said();
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
  EXPECT_THAT(said, testing::ContainsRegex("a scan needs up to [0-9]+ MB, the disk of .*monday has 20 MB free"));
  EXPECT_THAT(said, HasSubstr("--out"));
  EXPECT_THAT(said, HasSubstr("nothing was moved"));
  EXPECT_EQ(read_text(small.out), "") << "no session, and so no event of laser or arm";
}

TEST(SmallDisk, MakesDoctorSayThatTheRigCannotRun) {
  SKIP_WITHOUT_MOUNTS();
  const SmallDisk small(20);
  EXPECT_EQ(small.run("$tankrig doctor --seconds 0.1 --sessions \"$disk\""), 1);
  const std::string report = read_text(small.out);
  EXPECT_THAT(report, testing::ContainsRegex("disk +bad"));
  EXPECT_THAT(report, testing::ContainsRegex("disk space +bad +a scan needs up to [0-9]+ MB"));
  EXPECT_THAT(report, HasSubstr("tank-sim: this machine cannot run this rig"));
  EXPECT_THAT(report, Not(HasSubstr("can run this rig")));
}

TEST(SmallDisk, IsNoBarToADryRun) {
  SKIP_WITHOUT_MOUNTS();
  EXPECT_EQ(SmallDisk(1).run("$tankrig scan --dry-run --out \"$disk/monday\""), 0);
}

TEST(SmallDisk, MakesRecoverInPlaceSuggestACopyElsewhere) {
  SKIP_WITHOUT_MOUNTS();
  const fs::path session = scratch_folder() / "session", copy = scratch_folder() / "copy";
  {
    SessionInfo info = some_info();
    info.object.reset();
    info.rig_hash.clear();
    SessionWriter writer(session, info);
    record(writer, 3);
    writer.close("complete");
  }
  const SmallDisk small(1);
  EXPECT_EQ(small.run("cp -r '" + session.string() + "' \"$disk/s\"\ndd if=/dev/zero of=\"$disk/full\" 2>/dev/null\n" +
                      "$tankrig session recover \"$disk/s\" && exit 99\n" +
                      "$tankrig session recover \"$disk/s\" --out '" + copy.string() + "' >/dev/null 2>&1"),
            0);
  const std::string said = small.said();
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
  EXPECT_THAT(said, HasSubstr("No space left on device"));
  EXPECT_THAT(said, HasSubstr("tankrig session recover " + small.disk.string() + "/s --out DIR"));
  EXPECT_TRUE(compare_checksums(copy).empty());
}

TEST(SmallDisk, EndsASweepInOneLineAndKeepsThePointsItHas) {
  SKIP_WITHOUT_MOUNTS();
  const SmallDisk small(1);
  const std::string rig = small_rig(scratch_folder() / "rig").string();
  EXPECT_EQ(small.run("dd if=/dev/zero of=\"$disk/full\" bs=1k count=724 status=none\n"
                      "$tankrig bench etc/benchmarks/paper-figures-8-9-coarse.xml --rig '" +
                      rig +
                      "' --out \"$disk/sweep\"; code=$?\n"
                      "wc -l <\"$disk/sweep/points.jsonl\"; exit $code"),
            1);
  const std::string said = small.said(), line = "\ntankrig: ";
  ASSERT_NE(said.find(line), std::string::npos) << said;
  EXPECT_THAT(said.substr(said.find(line)), testing::MatchesRegex("\ntankrig: .*sweep/.*: No space left on device\n"));
  EXPECT_GE(std::stoi(read_text(small.out)), 1) << "points are kept, and the sweep can go on";
}

}  // namespace
}  // namespace tankrig::test
