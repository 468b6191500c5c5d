// Software- and position-triggered capture in real time: the scan's own threads, the GigE driver, an emulated camera.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <set>

#include "rig/plan/plan_csv.hpp"
#include "tests/camera/gige_rig.hpp"
#include "tests/executive/mock_rig.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

constexpr int kWidth = 160, kHeight = 120;
constexpr double kPollHz = 2000;
constexpr double kSpacing = 4e-3;          // rad: 25 a second
constexpr std::uint64_t kMayGoUnseen = 6;  // the first two exposures of each of three streams (AravisCamera)
constexpr int kAttempts = 3;               // a busy machine triggers late: how well it can be is asserted

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
    s.sweep_from = 1.35;
    s.sweep_to = 1.55;
    s.dark_frames = 8;
    s.settle = s.laser_warm_up = s.camera_lead = 0.2;
    mock.laser_warm_up = 100ms;
    s.real_time.required = false;
    s.real_time.overruns = 0;
    s.heartbeat_timeout = 1;  // a busy machine is not what is tested
    s.feedback_timeout = 1;
    s.following_error_limit = 0.3;
    power_on();
  }

  ScanResult run(const TriggerSettings& trigger) {
    sim::GigeCameraSettings device;
    device.width = kWidth;
    device.height = kHeight;
    device.exposure_us = 3000;
    device.trigger_poll_hz = kPollHz;
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
    return run_scan(job);
  }

  /// What was really exposed in that frame.
  Truth truth(const FrameRecord& frame) const {
    const auto off = [&](const Truth& t) { return std::abs(seconds(t.middle - frame.stamp)); };
    return *std::min_element(truth_.begin(), truth_.end(),
                             [&](const Truth& a, const Truth& b) { return off(a) < off(b); });
  }

  /// Every frame has its trigger, and every trigger its frame, but for a stream's first.
  bool paired(const ScanResult& result) const {
    const auto count = [&](const char* reason) {
      const auto found = result.counts.find(std::string("mono.") + reason);
      return found == result.counts.end() ? 0 : found->second;
    };
    std::printf("triggers lost %d, dropped %d, refused %d; frames without one %d\n",
                static_cast<int>(count("trigger_lost")), static_cast<int>(count("trigger_dropped")),
                static_cast<int>(count("trigger_refused")), static_cast<int>(count("untriggered")));
    const bool stamped = std::all_of(sink.frames.begin(), sink.frames.end(), [&](const FrameRecord& f) {
      return std::abs(seconds(truth(f).middle - f.stamp)) < 2e-3;
    });
    return stamped && count("trigger_dropped") + count("trigger_refused") + count("untriggered") == 0 &&
           count("trigger_lost") <= kMayGoUnseen;
  }

 private:
  std::mutex mutex_;
  std::vector<Truth> truth_;
};

class GigeTrigger : public testing::GigeTest {};

TEST_F(GigeTrigger, ExposesAtEqualElbowAngles) {
  bool good = false;
  for (int attempt = 0; attempt < kAttempts && !good; ++attempt) {
    WireRig rig;
    const ScanResult result = rig.run({TriggerMode::kPosition, kSpacing, std::nullopt});
    ASSERT_EQ(result.status, "complete");
    const auto frames = rig.sink.of("mono", Phase::kSweep);
    ASSERT_GT(frames.size(), 30u);
    std::vector<double> off;
    std::set<long> seen;
    for (const FrameRecord& f : frames) {
      const double lines = (rig.truth(f).elbow - rig.s.sweep_from) / kSpacing;
      off.push_back(std::abs(lines - std::round(lines)) * kSpacing);
      seen.insert(std::lround(lines));
    }
    const double usual = median(off);
    good = rig.paired(result) && usual < 0.1 * kSpacing;
    std::printf(
        "%zu frames at %zu of 50 angles %.1f mrad apart; off by %.3f mrad in the median, %.3f at most; a look "
        "for the trigger takes up to %.3f mrad\n",
        frames.size(), seen.size(), 1e3 * kSpacing, 1e3 * usual, 1e3 * *std::max_element(off.begin(), off.end()),
        1e3 * rig.s.sweep_velocity / kPollHz);
  }
  EXPECT_TRUE(good);
}

TEST_F(GigeTrigger, ExposesAtWholePeriodsOfThePlan) {
  bool good = false;
  for (int attempt = 0; attempt < kAttempts && !good; ++attempt) {
    WireRig rig;
    const ScanResult result = rig.run({TriggerMode::kSoftware, 0, std::nullopt});
    ASSERT_EQ(result.status, "complete");
    Stamp zero;
    for (const auto& e : rig.sink.events)
      if (e.kind == kPlanZeroEvent) zero = e.when;
    const auto frames = rig.sink.of("mono", Phase::kSweep);
    ASSERT_GT(frames.size(), 30u);
    std::vector<double> off;
    for (const FrameRecord& f : frames) {
      const double periods = seconds(rig.truth(f).middle - zero) * 25;
      off.push_back(std::abs(periods - std::round(periods)) / 25);
    }
    const double usual = median(off);
    good = rig.paired(result) && usual < 4e-3;
    std::printf(
        "%zu frames; off their time by %.2f ms in the median, %.2f at most; a look for the trigger takes up to "
        "%.2f ms\n",
        frames.size(), 1e3 * usual, 1e3 * *std::max_element(off.begin(), off.end()), 1e3 / kPollHz);
  }
  EXPECT_TRUE(good);
}

}  // namespace
}  // namespace tankrig
