// Software- and position-triggered capture in real time: the scan's own threads, the GigE driver, an emulated camera.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <string_view>

#include "rig/plan/plan_csv.hpp"
#include "session/reading/frame_account.hpp"
#include "session/recording/event_kinds.hpp"
#include "tests/camera/gige_rig.hpp"
#include "tests/support/machine_witness.hpp"
#include "tests/support/mock_rig.hpp"
#include "tests/trigger/planned_exposures.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using testing_support::kStarved;

constexpr int kWidth = 160, kHeight = 120;
constexpr double kSpacing = 4e-3;  // rad: 25 a second
constexpr double kPeriod = 0.04;   // s

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// The mock arm in real time, and one camera on the wire that waits for its triggers.
struct WireRig : testing_support::MockRigUnder<MonotonicClock> {
  struct Truth {
    Stamp middle;
    double elbow;
  };

  WireRig() {
    s.park << 0, 0.12, 1.33, 0, 0.1;
    s.posture = s.park;
    s.sweep.from = 1.35;
    s.sweep.to = 1.47;
    s.sweep.lead_in = 0.1;
    s.move.velocity = 0.3;
    s.capture.dark_frames = 8;
    s.move.settle = s.capture.laser_warm_up = s.capture.camera_lead = 0.2;
    mock.laser_warm_up = 100ms;
    s.real_time.required = false;
    s.real_time.overruns = 0;
    s.control.heartbeat_timeout = 1;  // a busy machine is not what is tested
    s.control.feedback_timeout = 1;
    s.control.following_error_limit = 0.3;
    power_on();
  }

  /// One scan with this trigger, in which every exposure of the plan has its fate.
  ScanResult run(const TriggerSettings& trigger) {
    sim::GigeCameraSettings device;
    device.width = kWidth;
    device.height = kHeight;
    device.exposure_us = 3000;
    sim::GigeCameraEmulator emulator(
        device, [](std::uint64_t, Stamp, Duration) { return cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(20)); },
        [this](std::uint64_t, Stamp begin, Duration exposure) {
          const std::lock_guard lock(mutex_);
          const Stamp middle = begin + exposure / 2;
          truth_.push_back({middle, arm->truth_at(middle)[kElbow]});
        });
    AravisSettings driver;
    driver.info = {"mono", kWidth, kHeight, 1, 25};
    driver.address = "127.0.0.1";
    driver.exposure_us = 3000;
    driver.packet_size = 9000;
    driver.trigger = "software";
    AravisCamera camera(driver);
    plan = std::make_unique<ScanPlan>(make_scan_plan(s, read_posture(*arm, clock, 2s)));
    ScanJob job{
        *plan,   s, clock, *arm, *laser, {{&camera, RecordWhen::kAll, {}, trigger}}, sink, stop, interlock_closed,
        progress};
    const ScanResult result = run_scan(job);
    const bool at_angles = trigger.mode == TriggerMode::kPosition;
    planned_ = testing_support::planned_times(*plan, kPeriod, !at_angles) +
               (at_angles ? testing_support::planned_angles(s, kSpacing) : 0);
    expect_every_trigger_has_its_fate(result, emulator, camera);
    exposed_ = emulator.exposures();
    sent_ = emulator.sent();
    ignored_ = emulator.triggers_ignored();
    return result;
  }

  /// On a machine that keeps time: a trigger is late for its angle or time, or comes while the camera still exposes;
  /// for no other reason is a frame of the plan missing.
  void expect_nothing_else_lost(const ScanResult& result) const {
    EXPECT_EQ(sent_, exposed_);
    const std::uint64_t skipped = count(result, "trigger_skipped"), lost = count(result, "trigger_lost");
    EXPECT_EQ(lost, ignored_);
    EXPECT_EQ(sink.frames.size() + count(result, "not_recorded") + skipped + lost, planned_);
    for (const auto& [reason, frames] : frame_reasons(result.counts, "mono"))
      EXPECT_TRUE(reason == "not_recorded" || reason == "trigger_skipped" || reason == "trigger_lost")
          << reason << " " << frames;
  }

  /// What was really exposed in that frame.
  Truth truth(const FrameRecord& frame) const {
    const auto off = [&](const Truth& t) { return std::abs(seconds(t.middle - frame.stamp)); };
    return *std::min_element(truth_.begin(), truth_.end(),
                             [&](const Truth& a, const Truth& b) { return off(a) < off(b); });
  }

  const testing_support::MachineWitness witness;

  static std::uint64_t count(const ScanResult& result, const char* reason) {
    const auto found = result.counts.find(std::string("mono.") + reason);
    return found == result.counts.end() ? 0 : found->second;
  }

 private:
  /// From trigger to command to exposure to frame: what is lost is lost at a station, and counted there. A camera that
  /// exposes ignores a trigger: two may be that close where the machine is busy.
  void expect_every_trigger_has_its_fate(const ScanResult& result, const sim::GigeCameraEmulator& emulator,
                                         const Camera& camera) const {
    // What was on its way when the scan ended is told of when it has come.
    testing::wait_for([&] { return camera.counters().delivered + camera.counters().left_out() >= emulator.sent(); });
    const CameraCounters received = camera.counters();
    const auto given = std::find_if(result.sync.begin(), result.sync.end(),
                                    [](const Statistic& one) { return std::string_view(one.name) == "mono.triggers"; });
    ASSERT_NE(given, result.sync.end());
    const auto fired = static_cast<std::uint64_t>(given->value);
    std::printf("triggers: %d given, %d late for their angle or time; exposures: %d, %d triggers ignored; frames: %d\n",
                static_cast<int>(fired), static_cast<int>(count(result, "trigger_skipped")),
                static_cast<int>(emulator.exposures()), static_cast<int>(emulator.triggers_ignored()),
                static_cast<int>(received.delivered));
    std::printf("%s\n", account_line(result.counts, "mono", result.account.at("mono")).c_str());
    EXPECT_EQ(count(result, "trigger_dropped") + count(result, "trigger_refused"), 0u);
    EXPECT_EQ(fired, emulator.exposures() + emulator.triggers_ignored()) << "each came to the camera";
    EXPECT_EQ(received.delivered + received.left_out(), emulator.sent()) << "each came back, or the driver counts it";
    EXPECT_EQ(fired + count(result, "trigger_skipped") + count(result, "trigger_unfired"), planned_)
        << "each of the plan was given, or is counted";
    EXPECT_EQ(result.account.at("mono").expected, planned_);
    EXPECT_EQ(result.account.at("mono").unaccounted, 0) << "each is recorded, or left out for a reason";
    for (const FrameRecord& f : sink.frames) EXPECT_NEAR(seconds(truth(f).middle - f.stamp), 0, 2e-3);
  }

  std::mutex mutex_;
  std::vector<Truth> truth_;
  std::uint64_t planned_ = 0, exposed_ = 0, sent_ = 0, ignored_ = 0;
};

class GigeTrigger : public testing::GigeTest {};

TEST_F(GigeTrigger, ExposesAtEqualElbowAngles) {
  constexpr std::size_t kAngles = 31;
  WireRig rig;
  ASSERT_EQ(testing_support::planned_angles(rig.s, kSpacing), kAngles);
  const ScanResult result = rig.run({TriggerMode::kPosition, kSpacing, std::nullopt});
  ASSERT_EQ(result.status, "complete");
  const auto frames = rig.sink.of("mono", Phase::kSweep);
  EXPECT_LE(frames.size(), kAngles);
  TANKRIG_SKIP_IF_LATE(rig.witness, kStarved);
  rig.expect_nothing_else_lost(result);
  EXPECT_GE(frames.size() + rig.count(result, "trigger_skipped") + rig.count(result, "trigger_lost"), kAngles);
  ASSERT_GT(frames.size(), kAngles / 2);
  std::vector<double> off;
  for (const FrameRecord& f : frames) {
    const double lines = (rig.truth(f).elbow - rig.s.sweep.from) / kSpacing;
    off.push_back(std::abs(lines - std::round(lines)) * kSpacing);
  }
  const double usual = median(off);
  std::printf("%zu frames of %zu angles %.1f mrad apart; off by %.3f mrad in the median, %.3f at most\n", frames.size(),
              kAngles, 1e3 * kSpacing, 1e3 * usual, 1e3 * *std::max_element(off.begin(), off.end()));
  EXPECT_LT(usual, 0.1 * kSpacing);
}

TEST_F(GigeTrigger, ExposesAtWholePeriodsOfThePlan) {
  WireRig rig;
  const ScanResult result = rig.run({TriggerMode::kSoftware, 0, std::nullopt});
  ASSERT_EQ(result.status, "complete");
  TANKRIG_SKIP_IF_LATE(rig.witness, kStarved);
  rig.expect_nothing_else_lost(result);
  Stamp zero;
  for (const auto& e : rig.sink.events)
    if (e.kind == event_kind::kPlan) zero = e.when;
  const auto frames = rig.sink.of("mono", Phase::kSweep);
  ASSERT_GT(frames.size(), 15u);
  std::vector<double> off;
  for (const FrameRecord& f : frames) {
    const double periods = seconds(rig.truth(f).middle - zero) / kPeriod;
    off.push_back(std::abs(periods - std::round(periods)) * kPeriod);
  }
  const double usual = median(off);
  std::printf("%zu frames; off their time by %.2f ms in the median, %.2f at most\n", frames.size(), 1e3 * usual,
              1e3 * *std::max_element(off.begin(), off.end()));
  EXPECT_LT(usual, 0.1 * kPeriod);
}

}  // namespace
}  // namespace tankrig
