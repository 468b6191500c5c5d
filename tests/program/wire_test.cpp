// The simulated tank behind real interfaces: every device through its driver and an emulated wire, in real time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "drivers/can/can_log.hpp"
#include "session/reading/session.hpp"
#include "tests/program/program.hpp"
#include "tests/program/true_exposures.hpp"
#include "tests/support/awake_machine.hpp"
#include "tests/support/machine_witness.hpp"

namespace fs = std::filesystem;
using nlohmann::json;

namespace tankrig::test {
namespace {

using testing::ContainsRegex;
using testing_support::kStarved;

constexpr double kEnough =
    0.25;  // of a scan's frames must have a punctual machine about them, for others to be judged by

/// One try over a carrier, and how the machine kept time meanwhile.
struct WireScan {
  ProgramRun run;
  std::vector<testing_support::MachineWitness::Late> late;
  fs::path truth;  ///< folder of CAMERA.csv
  json result;     ///< with the session: nothing of them if the scan failed
  Session session;
  Stamp first_exposure{}, last_exposure{};  ///< of any camera

  /// At most, while a camera ran; of a scan that failed, at all.
  Duration latest() const {
    Duration most{};
    for (const auto& one : late)
      if (session.frames.empty() || (one.came >= first_exposure && one.due <= last_exposure))
        most = std::max(most, one.came - one.due);
    return most;
  }
  /// Did the machine keep the emulators' time about then? A reading more than kNear away is of no use to a frame.
  bool punctual_about(Stamp when) const {
    constexpr Duration kNear = std::chrono::milliseconds{10};
    return std::none_of(late.begin(), late.end(),
                        [&](const auto& l) { return l.due <= when + kNear && when - kNear <= l.came; });
  }
  /// Share of its frames about which it did.
  double punctual_share() const {
    const auto punctual = std::count_if(session.frames.begin(), session.frames.end(),
                                        [&](const FrameRecord& frame) { return punctual_about(frame.stamp); });
    return static_cast<double>(punctual) / std::max<double>(1, static_cast<double>(session.frames.size()));
  }
};

/// Why emulated cameras cannot have their network here; empty if they can.
const std::string& forbidden() {
  static const std::string reason = [] {
    const ProgramRun run = run_tankrig({"emulate", "--rig", "tank-wire", "--device", "cameras", "--", "true"});
    return forbids_private_network(run) ? run.err : std::string();
  }();
  return reason;
}

/// Exposures that an emulated camera had no processor for, and numbered all the same.
std::uint64_t missed_by_emulator(const std::vector<TrueExposure>& exposed) {
  return exposed.empty() ? 0 : exposed.back().index + 1 - exposed.size();
}

WireScan try_wire_scan(const std::string& carrier, const fs::path& folder) {
  WireScan scan;
  scan.truth = folder / "truth";
  const testing_support::AwakeMachine awake;
  testing_support::MachineWitness witness;
  scan.run =
      run_tankrig({"emulate", "--rig", "tank-wire", "--truth", scan.truth.string(), "--", TANKRIG_PROGRAM, "scan",
                   "--rig", "tank-wire", "--carrier", carrier, "--json", "--out", (folder / "session").string()});
  scan.late = witness.lateness();
  std::printf("%s: the machine was %.1f ms late at most\n", carrier.c_str(), 1e3 * seconds(scan.latest()));
  if (scan.run.exit_code != 0) {
    std::printf("%s", scan.run.err.c_str());
    return scan;
  }
  scan.result = scan.run.json();
  scan.session = Session::open(folder / "session");
  for (const char* camera : {"mono", "left", "right"}) {
    const std::vector<TrueExposure> exposed = read_true_exposures(scan.truth / (std::string(camera) + ".csv"));
    if (exposed.empty()) continue;
    if (scan.first_exposure.ns == 0) scan.first_exposure = exposed.front().mid;
    scan.first_exposure = std::min(scan.first_exposure, exposed.front().mid);
    scan.last_exposure = std::max(scan.last_exposure, exposed.back().mid);
  }
  std::printf("%s: seed %llu; late by %.1f ms at most while a camera ran, punctual about %.0f %% of the frames\n",
              carrier.c_str(), static_cast<unsigned long long>(scan.session.info.seed), 1e3 * seconds(scan.latest()),
              100 * scan.punctual_share());
  return scan;
}

/// A scan over a carrier, made once for all tests.
const WireScan& wire_scan(const std::string& carrier) {
  static std::map<std::string, WireScan> done;
  const auto known = done.find(carrier);
  if (known != done.end()) return known->second;
  return done[carrier] = try_wire_scan(carrier, scratch_folder().parent_path() / ("wire-" + carrier));
}

const json& mock_scan() {
  static const json result = [] {
    const ProgramRun run = run_tankrig({"scan", "--json", "--out", (scratch_folder().parent_path() / "mock").string()});
    if (run.exit_code != 0) throw std::runtime_error("scan failed: " + run.err);
    return run.json();
  }();
  return result;
}

double count(const WireScan& scan, const std::string& name) {
  const auto it = scan.session.info.counts.find(name);
  return it == scan.session.info.counts.end() ? 0 : static_cast<double>(it->second);
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

class OnWires : public testing::Test {
 protected:
  /// A scan that failed is the machine's fault only where that was late.
  void take(const std::string& carrier) {
    if (!forbidden().empty()) GTEST_SKIP() << forbidden();
    scan_ = &wire_scan(carrier);
    if (scan_->run.exit_code == 0) return;
    EXPECT_THAT(scan_->run.err, ContainsRegex("laser off|LASER MAY BE ON|nothing moved")) << "it says what it left";
    TANKRIG_SKIP_IF_LATE(*scan_, kStarved);
    FAIL() << "exit code " << scan_->run.exit_code;
  }
  const WireScan& scan() const { return *scan_; }
  std::string never_punctual() const {
    return testing_support::machine_was_late(scan().latest(), testing_support::MachineWitness::kPunctual) +
           " about a quarter of the frames";
  }

 private:
  const WireScan* scan_ = nullptr;
};

class WireScans : public OnWires, public testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override { take(GetParam()); }
};

class WireScanOverCan : public OnWires {
 protected:
  void SetUp() override { take("can"); }
};

TEST_P(WireScans, ScoreAsTheMockRigWithTheSameCameras) {
  TANKRIG_SKIP_IF_LATE(scan(), kStarved);  // it costs frames, and so coverage
  for (const char* method : {"laser", "laser_paper", "stereo", "stereo_paper"}) {
    const double wire = scan().result.at(method).at("mean_error_m").get<double>();
    const double mock = mock_scan().at(method).at("mean_error_m").get<double>();
    EXPECT_LE(std::abs(wire - mock), std::max(0.1 * mock, 0.2e-3)) << method << ": " << wire << " m, mock " << mock;
    const double covered = scan().result.at(method).at("coverage").get<double>();
    const double mock_covered = mock_scan().at(method).at("coverage").get<double>();
    EXPECT_NEAR(covered, mock_covered, 0.1 * mock_covered) << method;
    RecordProperty(std::string(method) + "_mean_error_um", static_cast<int>(std::lround(1e6 * wire)));
  }
}

/// Against what the emulators know: when each frame was really exposed, and where the elbow really was.
TEST_P(WireScans, JoinFramesToJointsWithinTwoMillisecondsOfTheTruth) {
  const std::vector<TrueExposure> truth = read_true_exposures(scan().truth / "mono.csv");
  std::vector<double> late_ms, elbow_ms;
  int swept = 0;
  for (const FrameRecord& frame : scan().session.frames) {
    if (frame.camera != "mono" || frame.phase != Phase::kSweep) continue;
    ++swept;
    if (!scan().punctual_about(frame.stamp)) continue;
    const auto nearest = std::min_element(truth.begin(), truth.end(), [&](const auto& a, const auto& b) {
      return std::abs((a.mid - frame.stamp).count()) < std::abs((b.mid - frame.stamp).count());
    });
    ASSERT_NE(nearest, truth.end());
    late_ms.push_back(1e3 * std::abs(seconds(nearest->mid - frame.stamp)));
    elbow_ms.push_back(1e3 * std::abs((*frame.q)[2] - nearest->elbow) / 0.1);  // at 0.1 rad/s; 2 ms are 0.2 mm at 1 m
  }
  if (scan().punctual_share() < kEnough) GTEST_SKIP() << never_punctual();
  ASSERT_GT(swept, 150);
  ASSERT_GE(late_ms.size(), 50u);
  EXPECT_LE(quantile(late_ms, 0.99), 2.0);
  EXPECT_LE(quantile(elbow_ms, 0.99), 2.0);
  std::printf("%s: stamp p50 %.3f ms, p99 %.3f ms; elbow p50 %.3f ms, p99 %.3f ms\n", GetParam(),
              quantile(late_ms, 0.5), quantile(late_ms, 0.99), quantile(elbow_ms, 0.5), quantile(elbow_ms, 0.99));
}

TEST_P(WireScans, LoseNoFrameWithoutAReasonAndACount) {
  for (const char* name : {"mono", "left", "right"}) {
    const std::string camera = name;
    const FrameRecord* before = nullptr;
    double gaps = 0;
    for (const FrameRecord& frame : scan().session.frames) {
      if (frame.camera != camera) continue;
      if (before && before->phase == frame.phase) gaps += static_cast<double>(frame.sequence - before->sequence - 1);
      before = &frame;
    }
    const CameraAccount& account = scan().session.info.account.at(camera);
    double left_out = 0;
    for (const auto& [reason, frames] : frame_reasons(scan().session.info.counts, camera))
      if (reason != "not_recorded") left_out += static_cast<double>(frames);
    std::printf("%s: %s: %s\n", GetParam(), name, account_line(scan().session.info.counts, camera, account).c_str());
    EXPECT_EQ(account.unaccounted, 0) << camera;
    EXPECT_LE(gaps, left_out) << camera;
    EXPECT_GE(account.expected, 20u) << camera;
  }
}

TEST_P(WireScans, LoseNoFrameThatWasExposedOnAMachineThatKeepsTime) {
  TANKRIG_SKIP_IF_LATE(scan(), kStarved);
  for (const char* name : {"mono", "left", "right"}) {
    const std::string camera = name;
    const CameraAccount& account = scan().session.info.account.at(camera);
    FrameCounts counts = scan().session.info.counts;
    const auto lost = counts.find(camera + ".lost");
    if (lost != counts.end() &&
        lost->second <= missed_by_emulator(read_true_exposures(scan().truth / (camera + ".csv"))))
      counts.erase(lost);
    EXPECT_TRUE(lost_nothing(counts, camera, account)) << account_line(scan().session.info.counts, camera, account);
    EXPECT_GE(count(scan(), camera + ".recorded"), 20) << camera;
  }
}

/// The rig's watchdog box got its edges to the end: one that had opened would have stopped the scan.
TEST_P(WireScans, RunBehindTheWatchdogBox) {
  const auto& devices = scan().session.info.devices;
  EXPECT_EQ(devices.at("watchdog_box.failures"), 0);
  TANKRIG_SKIP_IF_LATE(scan(), kStarved);
  constexpr double kEdgesPerSecond = 50;
  EXPECT_GT(devices.at("watchdog_box.edges"), 0.9 * kEdgesPerSecond * scan().session.info.simulated_s);
}

INSTANTIATE_TEST_SUITE_P(Carriers, WireScans, testing::Values("can", "serial"),
                         [](const auto& carrier) { return std::string(carrier.param); });

TEST_F(WireScanOverCan, KeepsFramesWithinTwoMillisecondsOfAJointSample) {
  std::vector<double> residual_ms;
  for (const FrameRecord& frame : scan().session.frames)
    if (scan().punctual_about(frame.stamp)) residual_ms.push_back(1e3 * seconds(frame.sync_residual));
  if (scan().punctual_share() < kEnough) GTEST_SKIP() << never_punctual();
  EXPECT_LE(quantile(residual_ms, 0.99), 2.0);
}

TEST_F(WireScanOverCan, LogsEveryFrameOfTheBus) {
  const auto frames = read_can_log(scan().session.path / "can.log");
  EXPECT_EQ(static_cast<double>(frames.entries.size()), scan().session.info.devices.at("can_log.recorded"));
  TANKRIG_SKIP_IF_LATE(scan(), kStarved);
  // Eleven frames an exchange, at most 350 exchanges a second.
  EXPECT_GT(static_cast<double>(frames.entries.size()), 11 * 100 * scan().session.info.simulated_s);
}

}  // namespace
}  // namespace tankrig::test
