// The simulated tank behind real interfaces: every device through its driver and an emulated wire, in real time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>

#include "drivers/can/can_log.hpp"
#include "rig/session/session.hpp"
#include "tests/program/program.hpp"
#include "tests/support/awake_machine.hpp"
#include "tests/support/machine_witness.hpp"

namespace fs = std::filesystem;
using nlohmann::json;

namespace tankrig::test {
namespace {

// Share of a scan's frames about which the machine has kept time:
constexpr double kEnough = 0.25;    ///< must
constexpr double kNearlyAll = 0.8;  ///< makes no other scan worth its time
constexpr int kTries = 5;

struct WireScan {
  json result;
  Session session;
  fs::path truth;  ///< folder of CAMERA.csv
  std::vector<testing_support::MachineWitness::Late> late;

  /// Did the machine keep the emulators' time about then? A reading more than kNear away is of no use to a frame.
  bool punctual_about(Stamp when) const {
    constexpr Duration kNear = std::chrono::milliseconds{10};
    return std::none_of(late.begin(), late.end(),
                        [&](const auto& l) { return l.due <= when + kNear && when - kNear <= l.came; });
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

/// Share of its frames about which the machine kept the emulators' time.
double punctual_share(const WireScan& scan) {
  const auto& frames = scan.session.frames;
  const auto punctual = std::count_if(frames.begin(), frames.end(),
                                      [&](const FrameRecord& frame) { return scan.punctual_about(frame.stamp); });
  return static_cast<double>(punctual) / std::max<double>(1, static_cast<double>(frames.size()));
}

/// tank-wire, which outlasts seconds without a processor: what it loses then are frames.
fs::path unhurried_rig(const fs::path& folder) {
  return patient_wire_rig(
      folder, {{"feedback_timeout_s: 1, heartbeat_timeout_s: 1", "feedback_timeout_s: 5, heartbeat_timeout_s: 5"},
               {"silence_timeout_ms: 1000", "silence_timeout_ms: 5000"},
               {"answer_timeout_ms: 1000", "answer_timeout_ms: 4000"},
               {"\n  arm:\n    power_up_rad",
                "\n  laser: {watchdog_ms: 15000}\n  arm:\n    watchdog_ms: 10000\n    power_up_rad"}});
}

/// A scan over a carrier; nothing if it failed on a machine that starved it.
std::optional<WireScan> try_wire_scan(const std::string& carrier, const fs::path& rig, const fs::path& folder) {
  const testing_support::AwakeMachine awake;
  testing_support::MachineWitness witness;
  const ProgramRun run = run_tankrig({"emulate", "--rig", rig.string(), "--truth", (folder / "truth").string(), "--",
                                      TANKRIG_PROGRAM, "scan", "--rig", rig.string(), "--carrier", carrier, "--json",
                                      "--out", (folder / "session").string()});
  const auto late = witness.lateness();
  std::printf("%s: the machine was %.1f ms late at most\n", carrier.c_str(), 1e3 * seconds(witness.latest()));
  if (run.exit_code != 0 && witness.latest() > testing_support::kStarved) {
    std::printf("%s", run.err.c_str());
    return {};
  }
  if (run.exit_code != 0) throw std::runtime_error("scan failed: " + run.err);
  WireScan scan{run.json(), Session::open(folder / "session"), folder / "truth", late};
  std::printf("%s: punctual about %.0f %% of the frames\n", carrier.c_str(), 100 * punctual_share(scan));
  return scan;
}

/// A scan over a carrier, made once for all tests: the first about nearly all of whose frames the machine kept time, of
/// five at most; else that with the most such frames. The first try is the shipped rig's.
const WireScan& wire_scan(const std::string& carrier) {
  static std::map<std::string, WireScan> done;
  const auto known = done.find(carrier);
  if (known != done.end()) return known->second;
  std::optional<WireScan> best;
  for (int i = 0; i < kTries && !(best && punctual_share(*best) >= kNearlyAll); ++i) {
    const fs::path folder = scratch_folder().parent_path() / ("wire-" + carrier + std::to_string(i));
    fs::remove_all(folder);  // of a case whose last scan failed
    auto scan = try_wire_scan(carrier, i == 0 ? "tank-wire" : unhurried_rig(folder / "rig"), folder);
    if (scan && (!best || punctual_share(*scan) > punctual_share(*best))) best = std::move(scan);
  }
  if (!best) throw std::runtime_error("no scan was to be had");
  return done[carrier] = *std::move(best);
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

struct TrueExposure {
  Stamp mid;
  double elbow;
};

std::vector<TrueExposure> read_truth(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  std::vector<TrueExposure> out;
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    std::string index, mid, elbow;
    std::getline(cells, index, ',');
    std::getline(cells, mid, ',');
    std::getline(cells, elbow, ',');
    out.push_back({Stamp{std::stoll(mid)}, std::stod(elbow)});
  }
  return out;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

class WireScans : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (!forbidden().empty()) GTEST_SKIP() << forbidden();
  }
  const WireScan& scan() const { return wire_scan(GetParam()); }
};

TEST_P(WireScans, ScoreAsTheMockRigWithTheSameCameras) {
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
  const std::vector<TrueExposure> truth = read_truth(scan().truth / "mono.csv");
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
  ASSERT_GT(swept, 150);
  ASSERT_GE(punctual_share(scan()), kEnough);
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
    double counted = 0;
    for (const char* reason : {"lost", "incomplete", "overrun", "joints_before", "joints_after", "joint_gap",
                               "laser_switching", "laser_wrong"})
      counted += count(scan(), camera + "." + reason);
    EXPECT_LE(gaps, counted) << camera;
    const double recorded = count(scan(), camera + ".recorded");
    EXPECT_GE(recorded + counted, 20) << camera;
    EXPECT_GE(recorded, 15) << camera;  // a busy machine may cost some
  }
}

INSTANTIATE_TEST_SUITE_P(Carriers, WireScans, testing::Values("can", "serial"),
                         [](const auto& carrier) { return std::string(carrier.param); });

TEST(WireScan, KeepsFramesWithinTwoMillisecondsOfAJointSampleOverCan) {
  if (!forbidden().empty()) GTEST_SKIP() << forbidden();
  std::vector<double> residual_ms;
  const WireScan& scan = wire_scan("can");
  for (const FrameRecord& frame : scan.session.frames)
    if (scan.punctual_about(frame.stamp)) residual_ms.push_back(1e3 * seconds(frame.sync_residual));
  ASSERT_GE(punctual_share(scan), kEnough);
  EXPECT_LE(quantile(residual_ms, 0.99), 2.0);
}

TEST(WireScan, LogsEveryFrameOfTheBus) {
  if (!forbidden().empty()) GTEST_SKIP() << forbidden();
  const WireScan& scan = wire_scan("can");
  const auto frames = read_can_log(scan.session.path / "can.log");
  EXPECT_EQ(static_cast<double>(frames.entries.size()), scan.session.info.devices.at("can_log.recorded"));
  // Eleven frames an exchange, at most 350 exchanges a second.
  EXPECT_GT(static_cast<double>(frames.entries.size()), 11 * 100 * scan.session.info.simulated_s);
}

}  // namespace
}  // namespace tankrig::test
