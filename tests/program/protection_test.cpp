// What protects people from a start that nobody expects, and a watchdog box beside a command, on emulated wires.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <optional>

#include "tests/program/program.hpp"
#include "tests/program/true_exposures.hpp"
#include "tests/support/machine_witness.hpp"
#include "tests/support/named_thread.hpp"

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

namespace tankrig::test {
namespace {

/// The wire rig behind its watchdog box; neither its arm nor its relay has a watchdog of its own.
fs::path boxed_rig(const std::string& box = "") {
  return patient_wire_rig(
      scratch_folder() / "rig",
      {{"heartbeat_output: {kind: none}", kShippedBox[0]},
       {"enable_input: {kind: none}", kShippedBox[1]},
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
  edit(rig, {{"wait_s: 60", "wait_s: 1"}});
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

TEST(AWatchdogBox, TakesArmAndLaserAwayInASweepWhoseProgramAndGuardianStandStill) {
  constexpr Duration kOpens = 200ms, kOneHalfPeriod = 20ms, kExposure = 10ms, kWatched = 1s, kLongest = 60s;
  constexpr double kStill_rad = 2e-3;  // it coasts
  MonotonicClock clock;
  const fs::path rig = boxed_rig(), truth = scratch_folder() / "truth";
  const auto exposures = [&] { return read_true_exposures(truth / "mono.csv"); };
  const auto until = [&](const auto& condition) {
    for (const Stamp end = clock.now() + kLongest; clock.now() < end; clock.sleep_until(clock.now() + 10ms))
      if (condition()) return true;
    return false;
  };
  const auto swept = [&] {
    const auto seen = exposures();
    return seen.size() > 1 && seen.back().laser == 1 && std::abs(seen.back().elbow - seen.end()[-2].elbow) > 1e-3;
  };
  const testing_support::MachineWitness throughout;
  std::optional<testing_support::MachineWitness> witness;
  std::optional<Stamp> stopped;
  const auto stop_both = [&](const std::string& line, int emulator) {
    if (stopped || line.find("scan: sweep") == std::string::npos) return;
    const pid_t scan = testing_support::child_of(emulator);
    const pid_t guardian = scan > 0 ? testing_support::child_of(scan) : 0;
    if (guardian <= 0 || !until(swept)) return;
    witness.emplace();
    for (const pid_t process : {guardian, scan}) kill(process, SIGSTOP);
    stopped = clock.now();
    until([&] { return exposures().back().mid - *stopped > kWatched; });
    (void)witness->lateness();
    for (const pid_t process : {guardian, scan}) kill(process, SIGKILL);
  };
  const ProgramRun run =
      run_tankrig({"emulate", "--rig", rig.string(), "--truth", truth.string(), "--", TANKRIG_PROGRAM, "scan", "--rig",
                   rig.string(), "--out", (scratch_folder() / "session").string()},
                  stop_both);
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  if (!stopped) {
    TANKRIG_SKIP_IF_LATE(throughout, testing_support::kStarved);
  }
  ASSERT_TRUE(stopped) << run.err;
  std::vector<TrueExposure> after = exposures();
  const Stamp opened = *stopped + kOneHalfPeriod + kOpens + kExposure;
  std::erase_if(after, [&](const TrueExposure& e) { return e.mid < opened; });
  ASSERT_GT(after.size(), 5u);
  TANKRIG_SKIP_IF_LATE(*witness, testing_support::kStarved);
  for (const TrueExposure& e : after) {
    EXPECT_EQ(e.laser, 0) << 1e3 * seconds(e.mid - *stopped) << " ms after it";
    EXPECT_NEAR(e.elbow, after.back().elbow, kStill_rad) << 1e3 * seconds(e.mid - *stopped) << " ms after it";
  }
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
  const Edits lamp{
      {"  safety:\n", "  safety:\n    warning_output: {kind: bytes, device: runtime/lamp}\n    start_warning_s: 0\n"}};
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
      small_rig(scratch_folder() / "rig", {{"\n  safety: {", "\n  safety: {commissioned_within_h: 12, "}});
  const fs::path session = scratch_folder() / "session";
  EXPECT_EQ(run_tankrig({"scan", "--rig", rig.string(), "--out", session.string()}).exit_code, 1);
  ASSERT_FALSE(fs::exists(session));
  const ProgramRun run =
      run_tankrig({"scan", "--rig", rig.string(), "--out", session.string(), "--waive", "commission"});
  ASSERT_TRUE(fs::exists(session / "session.yaml")) << run.err;
  EXPECT_THAT(read_text(session / "session.yaml"), HasSubstr("\ncommission: \"waived: commission\"\n"));
}

/// A boxed rig that asks for a start-up test.
fs::path rig_to_commission() {
  const fs::path rig = boxed_rig();
  edit(rig, {{"  safety:\n", "  safety:\n    commissioned_within_h: 24\n"}});
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
  edit(rig, {{"  safety:\n", "  safety:\n    beam: {waived: [left, right]}\n"}});
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

TEST(AStartUpTest, OfAHealthyRigWithThreeCamerasPassesAndLetsItMoveUntilItsFileIsChanged) {
  const fs::path rig = rig_to_commission();
  edit(rig, {{"laser: {watchdog_ms: 0}", "laser: {watchdog_ms: 1000}"}});
  EXPECT_EQ(jogged(rig).exit_code, 1) << "before it";
  const testing_support::MachineWitness witness;
  const ProgramRun run = commissioned(rig);
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  if (run.exit_code != 0) {
    TANKRIG_SKIP_IF_LATE(witness, testing_support::kStarved);
  }
  ASSERT_EQ(run.exit_code, 0) << run.err << run.out;
  for (const char* step : {"disk", "encoders", "lid", "enable"})
    EXPECT_THAT(told(run, step), StartsWith("passed: ")) << step;
  EXPECT_EQ(told(run, "beam"), "passed: 3 cameras: seen in 15 lit pictures, not seen in 15 dark ones");
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
