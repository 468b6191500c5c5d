// What protects people from a start that nobody expects, and a watchdog box beside a command, on emulated wires.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/program/program.hpp"

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

namespace tankrig::test {
namespace {

/// A wire rig behind an emulated watchdog box; neither its arm nor its relay has a watchdog of its own.
fs::path boxed_rig(const std::string& box = "") {
  return patient_wire_rig(
      scratch_folder() / "rig",
      {{"safety: {",
        "safety: {heartbeat_output: {kind: bytes, device: runtime/box}, enable_input: {kind: reply, wait_s: 30}, "},
       {"\nemulation:\n  arm:\n", "\nemulation:\n" + box + "  laser: {watchdog_ms: 0}\n  arm:\n    watchdog_ms: 0\n"}});
}

TEST(AWatchdogBox, IsResetBeforeAnythingMovesAndSeesEveryStepOfAJog) {
  const fs::path rig = boxed_rig();
  const ProgramRun run = run_tankrig({"arm", "jog", "--rig", rig.string(), "elbow", "3", "--relative", "--json"});
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.json().at("status"), "complete");
}

TEST(AWatchdogBox, ThatNobodyResetsLetsNothingMove) {
  const fs::path rig = boxed_rig("  box: {nobody_there: true}\n");
  edit(rig, {{"wait_s: 30", "wait_s: 1"}});
  const ProgramRun run = run_tankrig({"arm", "jog", "--rig", rig.string(), "elbow", "3", "--relative", "--json"});
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err,
              HasSubstr("watchdog box: not enabled within 1 s, expected somebody to press its button; laser off, "
                        "arm at rest"));
  for (const auto& joint : run.json().at("joints"))
    EXPECT_NEAR(joint.at("reached_deg").get<double>(), joint.at("from_deg").get<double>(), 0.05);
}

TEST(AWatchdogBox, ThatIsNotThereIsRefusedInOneLine) {
  const fs::path rig = boxed_rig();
  const ProgramRun run = run_tankrig({"emulate", "--rig", rig.string(), "--device", "arm", "--device", "laser", "--",
                                      "tankrig", "arm", "park", "--rig", rig.string()});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("scan: "));
  EXPECT_THAT(run.err, HasSubstr("box"));
}

TEST(AWatchdogBox, OnASimulatedRigIsRefused) {
  const fs::path rig = edited_rig(scratch_folder() / "rig", "\nscan:\n",
                                  "\nscan:\n  safety: {heartbeat_output: {kind: rts, device: /dev/ttyS0}}\n");
  const ProgramRun run = run_tankrig({"arm", "park", "--rig", rig.string()});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("found on a simulated rig, expected kind none"));
}

/// The same devices, named by a rig file that does not say that they are emulated: to the program they are real.
struct RealToTheProgram {
  fs::path served = patient_wire_rig(scratch_folder() / "served");
  fs::path rig = patient_wire_rig(scratch_folder() / "real");
  explicit RealToTheProgram(const Edits& edits = {}) {
    const std::string text = read_text(rig);
    write_text(rig, text.substr(0, text.find("\n# How the emulated devices behave")) + "\n");
    edit(rig, edits);
  }
  ProgramRun run(const std::vector<std::string>& command) const {
    std::vector<std::string> words{"emulate", "--rig", served.string(), "--device", "arm", "--device", "laser", "--"};
    words.insert(words.end(), command.begin(), command.end());
    return run_tankrig(words);
  }
};

TEST(AStart, OnDevicesIsRefusedWhereNobodyCanBeAsked) {
  const RealToTheProgram real;
  const ProgramRun run = real.run({"tankrig", "arm", "jog", "--rig", real.rig.string(), "elbow", "3", "--relative"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("its arm will move for 2 s (elbow 51.6 to 54.6 deg)"));
  EXPECT_THAT(run.err, HasSubstr("not confirmed: standard input is no terminal, expected --yes"));
  const ProgramRun home = real.run({"tankrig", "arm", "home", "--rig", real.rig.string()});
  EXPECT_EQ(home.exit_code, 1);
  EXPECT_THAT(home.err, HasSubstr("its arm will move every joint into its stop, without a check for obstacles"));
  EXPECT_THAT(home.err, HasSubstr("expected --yes"));
}

TEST(AStart, OnDevicesIsWarnedOfFirst) {
  const RealToTheProgram real;
  const ProgramRun run =
      real.run({"tankrig", "arm", "jog", "--rig", real.rig.string(), "elbow", "3", "--relative", "--yes", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("starts in 3 s"));
  EXPECT_EQ(run.json().at("status"), "complete");
}

TEST(AStart, NeedsTheLampThatTheRigFileNames) {
  const Edits lamp{{"safety: {", "safety: {warning_output: {kind: bytes, device: runtime/lamp}, start_warning_s: 0, "}};
  const RealToTheProgram real(lamp);
  const ProgramRun run = real.run({"tankrig", "arm", "park", "--rig", real.rig.string(), "--yes"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("lamp"));
}

TEST(AStart, OfASimulatedRigNeitherAsksNorWaits) {
  const ProgramRun run = run_tankrig({"arm", "jog", "elbow", "-1", "--relative", "--json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, Not(HasSubstr("starts in")));
}

}  // namespace
}  // namespace tankrig::test
