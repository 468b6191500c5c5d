// The time offset from whole simulated scans: mock devices, rendered pictures, the laser method's own detector.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "calibration/time_offset/time_offset.hpp"
#include "reconstruction/stripe/stripe_detector.hpp"
#include "rig/scan/before_start.hpp"
#include "rig/scan/scan.hpp"
#include "sim_backends/mock/mock_camera.hpp"
#include "tests/support/seeds.hpp"
#include "tests/world/render_scene.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

/// Keeps joints and stripes, not pictures.
class StripeSink final : public ScanSink {
 public:
  void joints(const JointState& state) override { recording.joints.push_back({state.stamp, state.q}); }
  void frame(const FrameRecord& record, const cv::Mat& image) override {
    if (record.phase != Phase::kSweep || !record.laser_on) return;
    StripeParameters parameters;
    parameters.orientation = StripeOrientation::kColumns;
    TimedStripe stripe{record.stamp, record.pass, {}};
    for (const StripePeak& p : detect_stripe(image, {}, parameters).peaks)
      stripe.points.push_back({static_cast<int>(p.column), p.position, p.sigma_px});
    recording.stripes.push_back(std::move(stripe));
  }
  void event(Stamp, std::string_view, const std::string&) override {}

  TimeOffsetRecording recording;
};

/// A short sweep there and back over the box in a small picture.
TimeOffsetSolution offset_of_scan(Duration injected, Duration in_rig_file = {}, std::uint64_t seed = 1) {
  sim::Scene scene = sim::testing::small_scene();
  scene.ambient_lux = 0;
  scene.lamps.clear();
  scene.water.particles_per_m3 = 0;
  const Transform bMc = scene.arm.wMb.inverse() * scene.cameras[0].wMc;
  const CameraModel model = scene.cameras[0].model;
  const int channels = scene.cameras[0].channels;
  const Transform eMl = scene.laser.eMl;
  sim::WorldOptions options;
  options.seed = seed;
  const sim::TankWorld world = sim::TankWorld::from_scene(std::move(scene), options);

  ScanSettings s;
  s.park << 0, 0.12, 1.6, 0, 0.1;
  s.posture << 0, 0.12, 0, 0, 0.1;
  s.sweep.from = 1.70;
  s.sweep.to = 1.85;
  s.sweep.passes = 2;
  s.capture.dark_frames = 0;
  sim::MockParameters mock;
  mock.camera.phase = 7ms;
  mock.camera.stamp_offset = injected;
  VirtualClock clock;
  sim::MockArm arm(world.arm(), mock.arm, s.park, clock);
  sim::MockLaser laser(mock.laser_warm_up, clock);
  sim::MockCamera camera({"mono", model.width, model.height, channels, 25}, mock.camera, clock, arm, laser,
                         [&](const std::string& name, const sim::Exposure& e) { return world.render(name, e); });
  StripeSink sink;
  const std::atomic<bool> stop{false};
  const ScanPlan plan = make_scan_plan(s, read_posture(arm, clock, 1s));
  ScanJob job{plan, s,     clock,
              arm,  laser, {{&camera, RecordWhen::kSweep, {}, {}, in_rig_file}},
              sink, stop,  [] { return true; }};
  const ScanResult result = run_scan(job);
  EXPECT_TRUE(result.complete()) << result.status;

  TimeOffsetProblem problem;
  problem.camera = model;
  problem.cMb = bMc.inverse();
  problem.arm = world.arm();
  const Vector3d normal = eMl.linear().col(0);
  problem.ePl = {normal, -normal.dot(eMl.translation())};
  problem.recordings = {std::move(sink.recording)};
  return solve(problem);
}

class InjectedOffset : public testing::TestWithParam<int> {};

TEST_P(InjectedOffset, IsRecoveredToHalfAMillisecond) {
  const double injected = 1e-3 * GetParam();
  const TimeOffsetSolution s = offset_of_scan(from_seconds(injected));
  std::printf(
      "injected %2d ms: found %.3f +- %.3f ms, %.2f +- %.3f mm on the target; clouds %.3f mm apart before, "
      "%.3f mm after; %zu places\n",
      GetParam(), 1e3 * s.offset, 1e3 * s.sigma, 1e3 * s.effect, 1e3 * s.effect_sigma, 1e3 * s.before.median,
      1e3 * s.after.median, s.pairs);
  EXPECT_NEAR(s.offset, injected, 0.5e-3);
  EXPECT_LT(s.sigma, 0.3e-3);
}

INSTANTIATE_TEST_SUITE_P(Milliseconds, InjectedOffset, testing::Values(0, 5, 20, 40, 60));

/// An interval is a promise about scans nobody has seen: other noise, other offsets.
TEST(OffsetInterval, HoldsTheTruthOfManyScansAsOftenAsItSays) {
  const int scans = testing_support::seeds(64);
  int held = 0;
  double squares = 0, variances = 0;
  for (int i = 0; i < scans; ++i) {
    const double injected = 1e-3 * (i * 7 % 61) + 1e-3 * (i * 13 % 32) / 32;
    const std::uint64_t seed = 1000 + static_cast<std::uint64_t>(i);
    const TimeOffsetSolution s = offset_of_scan(from_seconds(injected), {}, seed);
    const double error = s.offset - injected;
    std::printf("seed %d, injected %6.3f ms: off by %6.3f ms, sigma %.3f ms, interval +- %.3f ms\n",
                static_cast<int>(seed), 1e3 * injected, 1e3 * error, 1e3 * s.sigma, 1e3 * s.half_width);
    EXPECT_NEAR(error, 0, 0.5e-3);
    held += std::abs(error) <= s.half_width;
    squares += error * error / scans;
    variances += s.sigma * s.sigma / scans;
  }
  std::printf("error %.4f ms, sigma %.4f ms (both rms); ", 1e3 * std::sqrt(squares), 1e3 * std::sqrt(variances));
  testing_support::expect_honest(held, scans);
}

TEST(RigFileOffset, LeavesNoneToFind) { EXPECT_NEAR(offset_of_scan(40ms, 40ms).offset, 0, 0.5e-3); }

}  // namespace
}  // namespace tankrig
