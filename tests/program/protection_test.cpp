// What protects people from a start that nobody expects, and a watchdog box beside a command, on emulated wires.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/program/program.hpp"

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

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
  const auto json = run.json();
  for (const auto& joint : json.at("joints"))
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
  const ProgramRun run = real.run(
      {"tankrig", "arm", "jog", "--rig", real.rig.string(), "elbow", "3", "--relative", "--waive", "commission"});
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
  const ProgramRun run = real.run({"tankrig", "arm", "jog", "--rig", real.rig.string(), "elbow", "3", "--relative",
                                   "--yes", "--waive", "commission", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("starts in 3 s"));
  EXPECT_EQ(run.json().at("status"), "complete");
}

TEST(AStart, NeedsTheLampThatTheRigFileNames) {
  const Edits lamp{{"safety: {", "safety: {warning_output: {kind: bytes, device: runtime/lamp}, start_warning_s: 0, "}};
  const RealToTheProgram real(lamp);
  const ProgramRun run =
      real.run({"tankrig", "arm", "park", "--rig", real.rig.string(), "--yes", "--waive", "commission"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("lamp"));
}

TEST(AStart, OnDevicesIsRefusedWithoutAStartUpTestOfTheDay) {
  const RealToTheProgram real;
  const ProgramRun run =
      real.run({"tankrig", "arm", "jog", "--rig", real.rig.string(), "elbow", "3", "--relative", "--yes"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("rig.commission.yaml: found no start-up test, expected one: tankrig doctor "
                                 "--commission --operator NAME --rig "));
}

TEST(AStart, WithoutAStartUpTestStandsInTheSession) {
  const fs::path rig =
      small_rig(scratch_folder() / "rig", {{"\nscan:\n", "\nscan:\n  safety: {commissioned_within_h: 12}\n"}});
  const fs::path session = scratch_folder() / "session";
  EXPECT_EQ(run_tankrig({"scan", "--rig", rig.string(), "--out", session.string()}).exit_code, 1);
  ASSERT_FALSE(fs::exists(session));
  const ProgramRun run =
      run_tankrig({"scan", "--rig", rig.string(), "--out", session.string(), "--waive", "commission"});
  ASSERT_TRUE(fs::exists(session / "session.yaml")) << run.err;
  EXPECT_THAT(read_text(session / "session.yaml"), HasSubstr("\ncommission: \"waived: commission\"\n"));
}

/// A boxed rig that asks for a start-up test; one camera testifies, as in a sweep.
fs::path rig_to_commission() {
  const fs::path rig = boxed_rig();
  edit(rig, {{"safety: {", "safety: {commissioned_within_h: 24, beam: {waived: [left, right]}, "}});
  return rig;
}
ProgramRun commissioned(const fs::path& rig, const std::vector<std::string>& options = {}) {
  std::vector<std::string> words{"doctor",     "--commission", "--operator", "Anna",  "--rig",
                                 rig.string(), "--wait",       "20",         "--json"};
  words.insert(words.end(), options.begin(), options.end());
  return run_tankrig(words);
}
ProgramRun jogged(const fs::path& rig) {
  return run_tankrig({"arm", "jog", "--rig", rig.string(), "elbow", "-1", "--relative", "--json"});
}
std::string told(const ProgramRun& run, const std::string& step) {
  const auto told = run.json();
  for (const auto& one : told.at("steps"))
    if (one.at("step") == step)
      return one.at("verdict").get<std::string>() + ": " + one.at("measured").get<std::string>();
  return "no such step";
}

TEST(AStartUpTest, FindsARelayWithoutAWatchdogAndThenNothingMoves) {
  const fs::path rig = rig_to_commission();
  const ProgramRun run = commissioned(rig);
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  ASSERT_EQ(run.exit_code, 1) << run.err;
  EXPECT_THAT(told(run, "relay_watchdog"), HasSubstr("failed: not read back open by itself"));
  for (const char* step : {"disk", "encoders", "beam", "lid", "enable"})
    EXPECT_THAT(told(run, step), StartsWith("passed: ")) << step;
  const ProgramRun refused = jogged(rig);
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr("has steps that failed (relay_watchdog), expected none"));
}

TEST(AStartUpTest, OfAHealthyRigLetsItMoveUntilItsFileIsChanged) {
  const fs::path rig = rig_to_commission();
  edit(rig, {{"laser: {watchdog_ms: 0}", "laser: {watchdog_ms: 1000}"}});
  EXPECT_EQ(jogged(rig).exit_code, 1) << "before it";
  const ProgramRun run = commissioned(rig);
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  ASSERT_EQ(run.exit_code, 0) << run.err << run.out;
  EXPECT_THAT(told(run, "relay_watchdog"), StartsWith("passed: open "));
  EXPECT_EQ(run.json().at("operator"), "Anna");
  EXPECT_THAT(read_text(rig.parent_path() / "rig.commission.yaml"), HasSubstr("operator: \"Anna\""));
  const ProgramRun moved = jogged(rig);
  EXPECT_EQ(moved.exit_code, 0) << moved.err;
  edit(rig, {{"watchdog_ms: 1000", "watchdog_ms: 900"}});
  EXPECT_THAT(jogged(rig).err, HasSubstr("was made before the rig file was changed"));
}

TEST(AStartUpTest, NeedsANameAndDevices) {
  EXPECT_EQ(run_tankrig({"doctor", "--commission", "--rig", "tank-wire"}).exit_code, 2);
  EXPECT_THAT(run_tankrig({"doctor", "--commission", "--rig", "tank-wire", "--operator", ""}).err,
              HasSubstr("--operator: found nothing, expected the name of whoever stands at the tank"));
  EXPECT_THAT(run_tankrig({"doctor", "--commission", "--operator", "Anna"}).err,
              HasSubstr("--commission: found a simulated rig, expected one with devices"));
  EXPECT_EQ(run_tankrig({"doctor", "--operator", "Anna"}).exit_code, 2);
  EXPECT_EQ(run_tankrig({"doctor", "--commission", "--operator", "Anna", "--waive", "encoders"}).exit_code, 2);
}

TEST(AStart, OfASimulatedRigNeitherAsksNorWaits) {
  const ProgramRun run = run_tankrig({"arm", "jog", "elbow", "-1", "--relative", "--json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, Not(HasSubstr("starts in")));
}

}  // namespace
}  // namespace tankrig::test
