// `tankrig doctor` on this machine: what it says of rigs that need nothing, emulated devices, and devices that are
// away.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "tests/program/program.hpp"

using testing::HasSubstr;

namespace tankrig::test {
namespace {

std::optional<nlohmann::json> finding(const nlohmann::json& report, const std::string& what) {
  const auto& all = report.at("findings");
  const auto it = std::find_if(all.begin(), all.end(), [&](const auto& f) { return f.at("what") == what; });
  return it == all.end() ? std::nullopt : std::optional<nlohmann::json>(*it);
}

TEST(Doctor, FindsNothingMissingForASimulatedRig) {
  const ProgramRun run = run_tankrig({"doctor", "--seconds", "0.3", "--sessions", scratch_folder().string(), "--json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  for (const char* what :
       {"kernel", "governor", "sleep states", "privileges", "memory lock", "wake-up latency", "disk"})
    EXPECT_TRUE(finding(run.json(), what)) << what;
  EXPECT_TRUE(run.json().at("can_run").get<bool>());
  EXPECT_THAT(finding(run.json(), "devices").value().at("measured"), HasSubstr("nothing is needed"));
  EXPECT_THAT(run_tankrig({"doctor", "--seconds", "0.1", "--sessions", scratch_folder().string()}).out,
              HasSubstr("tank-sim: this machine can run this rig"));
}

TEST(Doctor, MeasuresLatencyAndDiskForARigInRealTime) {
  const ProgramRun run = run_tankrig(
      {"doctor", "--rig", "tank-wire", "--seconds", "0.3", "--sessions", scratch_folder().string(), "--json"});
  const nlohmann::json report = run.json();
  const bool disk_bad = finding(report, "disk").value().at("verdict") == "bad";
  EXPECT_TRUE(disk_bad ? run.exit_code == 1 : run.exit_code == 0 || run.exit_code == 3) << run.exit_code << run.err;
  EXPECT_NE(report.at("can_run").get<bool>(), disk_bad);
  EXPECT_THAT(finding(report, "disk space").value().at("measured"), HasSubstr("MB free"));
  EXPECT_THAT(finding(report, "wake-up latency").value().at("measured"), HasSubstr("p99"));
  EXPECT_THAT(finding(report, "disk").value().at("measured"), HasSubstr("MB/s"));
  EXPECT_THAT(finding(report, "CAN").value().at("measured"), HasSubstr("load"));
}

TEST(Doctor, SaysWhatADeviceThatIsAwayNeedsAndThatTheRigCannotRun) {
  const auto rig = scratch_folder() / "rig.yaml";
  write_text(rig, "base: " TANKRIG_SOURCE_DIR R"(/etc/rigs/tank-sim/rig.yaml
name: away
backend: devices
devices:
  arm: {driver: arm5e, carrier: can, can: {interface: nocan7, bitrate_bit_s: 1000000, exchange_rate_hz: 100}}
  cameras:
    mono: {driver: v4l2, device: /dev/no-video}
    left: {driver: aravis, address: 198.51.100.1, channels: 1}
    right: {driver: aravis, address: 198.51.100.2, channels: 1}
  laser: {driver: relay, device: /dev/no-laser}
)");
  const ProgramRun run = run_tankrig(
      {"doctor", "--rig", rig.string(), "--seconds", "0.1", "--sessions", scratch_folder().string(), "--json"});
  EXPECT_EQ(run.exit_code, 1) << run.err;
  const nlohmann::json report = run.json();
  EXPECT_THAT(finding(report, "disk").value().at("measured"), HasSubstr("the cameras deliver 46 MB/s"))
      << "25 times 720 x 576 in colour and twice 640 x 480 without";
  EXPECT_FALSE(report.at("can_run").get<bool>());
  for (const char* what : {"CAN nocan7", "laser", "camera mono", "camera left"}) {
    ASSERT_TRUE(finding(report, what)) << what;
    EXPECT_EQ(finding(report, what)->at("verdict"), "not there") << what;
    EXPECT_NE(finding(report, what)->at("cure"), "") << what;
  }
}

TEST(Doctor, OfARigThatCannotBePlannedSaysSoInALine) {
  const auto rig = small_rig(scratch_folder() / "rig", {{"laser_pairs: false", "laser_pairs: true"},
                                                        {"switches_per_frame: false", "switches_per_frame: true"}});
  const ProgramRun run = run_tankrig(
      {"doctor", "--rig", rig.string(), "--seconds", "0.1", "--sessions", scratch_folder().string(), "--json"});
  EXPECT_EQ(run.exit_code, 1) << run.err;
  ASSERT_TRUE(finding(run.json(), "plan")) << run.out;
  EXPECT_THAT(finding(run.json(), "plan")->at("measured"), HasSubstr("scan: laser_warm_up: found 1, expected"));
  EXPECT_TRUE(finding(run.json(), "disk"));
}

}  // namespace
}  // namespace tankrig::test
