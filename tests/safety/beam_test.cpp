// What the cameras say of the beam: a stripe in noise, a relay that has welded and a projector that has died while their
// electrical read-back says that all is well, and no false word on the simulated rigs.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <random>

#include "core/input_error.hpp"
#include "rig/capture/beam_view.hpp"
#include "rig/plan/light_check.hpp"
#include "rig/scan/before_start.hpp"
#include "rig/scan/scan.hpp"
#include "sim_backends/mock/mock_camera.hpp"
#include "sim_backends/world/tank_world.hpp"
#include "tests/support/recording_sink.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

constexpr int kPresent = 16, kAbsent = 12;  // BeamWatch's

/// A textured floor, with a stripe (0: none) across the columns or the rows, and Gaussian noise.
cv::Mat picture(std::mt19937& random, double stripe, double noise, bool turned = false, double lamp = 1,
                double at = 0.5, int channels = 3, cv::Size size = {640, 480}) {
  const int rows = turned ? size.width : size.height, cols = turned ? size.height : size.width;
  std::normal_distribution<double> gauss(0, noise);
  cv::Mat image(rows, cols, CV_MAKETYPE(CV_8U, channels));
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < cols; ++c) {
      const double off = r - (at * rows + 0.1 * c);
      const double floor = lamp * (80 + 30 * ((r / 40 + c / 40) % 2));
      for (int k = 0; k < channels; ++k) {
        const double light = k == channels / 2 ? stripe * std::exp(-0.5 * off * off / 4) : 0;
        const double value = floor + light + (noise > 0 ? gauss(random) : 0);
        image.ptr(r)[c * channels + k] = static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
      }
    }
  return turned ? cv::Mat(image.t()) : image;
}

class StripeSignOfSize : public testing::TestWithParam<cv::Size> {};

TEST_P(StripeSignOfSize, TellsAStripeFromNoiseInEitherDirection) {
  std::mt19937 random(1);
  for (const double noise : {0.0, 25.5})
    for (const bool turned : {false, true}) {
      const auto with = [&](double stripe) { return picture(random, stripe, noise, turned, 1, 0.5, 3, GetParam()); };
      DarkReference dark;
      for (int i = 0; i < 2; ++i) dark.add(with(0));
      const auto lit = look_for_stripe(with(90), dark.mean());
      ASSERT_TRUE(lit);
      EXPECT_GE(lit->triples, kPresent) << noise << " " << turned;
      int most = 0;
      for (int i = 0; i < 2; ++i) most = std::max(most, look_for_stripe(with(0), dark.mean())->triples);
      EXPECT_LT(most, kAbsent) << noise << " " << turned;
    }
}

INSTANTIATE_TEST_SUITE_P(Pictures, StripeSignOfSize,
                         testing::Values(cv::Size(640, 480), cv::Size(320, 240), cv::Size(240, 240)),
                         [](const auto& size) {
                           return std::to_string(size.param.width) + "x" + std::to_string(size.param.height);
                         });

TEST(StripeSign, TakesAnotherLampForNoStripe) {
  std::mt19937 random(2);
  DarkReference dark;
  for (int i = 0; i < 4; ++i) dark.add(picture(random, 0, 5));
  for (const double lamp : {0.5, 0.9, 1.1, 1.8})
    EXPECT_LT(look_for_stripe(picture(random, 0, 5, false, lamp), dark.mean())->triples, kPresent) << lamp;
}

TEST(StripeSign, SaysNothingOfPicturesItCannotCompare) {
  std::mt19937 random(3);
  const cv::Mat colour = picture(random, 0, 0), grey = picture(random, 0, 0, false, 1, 0.5, 1);
  EXPECT_FALSE(look_for_stripe(colour, grey));
  EXPECT_FALSE(look_for_stripe(colour, cv::Mat()));
  EXPECT_FALSE(look_for_stripe(cv::Mat::zeros(2, 2, CV_8UC1), cv::Mat::zeros(2, 2, CV_8UC1)));
  EXPECT_TRUE(look_for_stripe(grey, grey));
}

/// Reports what was commanded, whatever the projector does.
class LyingLaser final : public Laser {
 public:
  LyingLaser(sim::MockLaser& laser, const Clock& clock) : laser_(laser), clock_(clock) {}
  Status set(bool on) noexcept override {
    if (on != on_) since_ = clock_.now();
    on_ = on;
    return Laser::set(laser_, on);
  }
  Result<LaserState> state() noexcept override {
    const bool emitting = on_ && clock_.now() - since_ >= warm_up();
    return LaserState{on_, on_, emitting, emitting ? since_ + warm_up() : since_, std::nullopt};
  }
  Duration warm_up() const noexcept override { return laser_.warm_up(); }

 private:
  sim::MockLaser& laser_;
  const Clock& clock_;
  bool on_ = false;
  Stamp since_{};
};

/// Loses its frames until the projector shines.
class LateCamera final : public Camera {
 public:
  LateCamera(Camera& camera, sim::MockLaser& laser) : camera_(camera), laser_(laser) {}
  CameraInfo info() const override { return camera_.info(); }
  Status start() override { return camera_.start(); }
  Result<std::optional<Frame>> try_grab() override {
    auto frame = camera_.try_grab();
    if (!frame.ok() || !frame.value() || laser_.state().value().emitting) return frame;
    ++lost_;
    return std::optional<Frame>{};
  }
  std::optional<Stamp> next_frame_at() const override { return camera_.next_frame_at(); }
  void stop() noexcept override { camera_.stop(); }
  CameraCounters counters() const override {
    CameraCounters counters = camera_.counters();
    counters.lost += lost_;
    return counters;
  }

 private:
  Camera& camera_;
  sim::MockLaser& laser_;
  std::uint64_t lost_ = 0;
};

/// A mock rig whose cameras draw a stripe where the projector really shines; the mono camera sees the sweep, the left
/// one the dark blocks.
struct Rig {
  ScanSettings s;
  VirtualClock clock;
  testing_support::RecordingSink sink;
  std::atomic<bool> stop{false};
  sim::MockParameters mock;
  sim::MockArm arm;
  sim::MockLaser real;
  LyingLaser laser{real, clock};
  std::vector<std::unique_ptr<sim::MockCamera>> cameras;
  std::mt19937 random{4};
  Camera* second = nullptr;  // that records all, in place of the left one
  bool in_view = true;
  RecordWhen record = RecordWhen::kAll;
  std::function<void()> in_the_sweep = [] {};

  static ScanSettings settings() {
    ScanSettings s;
    s.park << 0, 0.12, 1.25, 0, 0.1;
    s.posture = s.park;
    s.sweep.from = 1.3;
    s.sweep.to = 1.5;
    return s;
  }
  Rig() : s(settings()), arm(arm5e(), mock.arm, s.park, clock), real(mock.laser_warm_up, clock) {
    for (const char* name : {"mono", "left"})
      cameras.push_back(
          std::make_unique<sim::MockCamera>(CameraInfo{name, 240, 240, 1, 25}, mock.camera, clock, arm, real,
                                            [this](const std::string&, const sim::Exposure& e) { return seen(e); }));
  }
  cv::Mat seen(const sim::Exposure& e) {
    cv::Mat image(240, 240, CV_8UC1);
    for (int r = 0; r < image.rows; ++r)
      for (int c = 0; c < image.cols; ++c) {
        const double off = r - 100 * (e.q[1][kElbow] - 0.9);
        image.ptr(r)[c] = static_cast<std::uint8_t>(60 + random() % 20 + 80 * e.laser[1] * std::exp(-0.2 * off * off));
      }
    return image;
  }
  ScanResult run() {
    const ScanPlan plan = make_scan_plan(s, read_posture(arm, clock, 1s));
    const StripeInView view = [this](const JointVector&) { return in_view; };
    ScanJob job{plan,
                s,
                clock,
                arm,
                laser,
                {{cameras[0].get(), record, view},
                 second ? ScanCamera{second, RecordWhen::kAll, view} : ScanCamera{cameras[1].get(), RecordWhen::kDark}},
                sink,
                stop,
                [] { return true; },
                [this](const ScanProgress& p) {
                  if (p.phase == Phase::kSweep && p.fraction > 0.4) in_the_sweep();
                }};
    return run_scan(job);
  }
};

TEST(BeamWatch, LetsAGoodScanPassAndSaysWhatWasSeen) {
  Rig rig;
  const ScanResult result = rig.run();
  EXPECT_TRUE(result.complete()) << result.status;
  EXPECT_TRUE(rig.sink.told("summary", "beam seen in "));
}

TEST(BeamWatch, FindsAWeldedRelayThatReadsBackOff) {
  Rig rig;
  rig.in_the_sweep = [&] { rig.real.faults.stuck_on = true; };
  const ScanResult result = rig.run();
  EXPECT_NE(result.status.find("stray beam"), std::string::npos) << result.status;
  EXPECT_TRUE(result.left.arm_at_rest);
}

TEST(BeamWatch, FindsADeadProjectorThatReadsBackOnWithinItsFrames) {
  Rig rig;
  Stamp died;
  rig.in_the_sweep = [&] {
    if (!rig.real.faults.dead) died = rig.clock.now();
    rig.real.faults.dead = true;
  };
  const ScanResult result = rig.run();
  EXPECT_NE(result.status.find("beam not seen"), std::string::npos) << result.status;
  Stamp told;
  for (const auto& e : rig.sink.events)
    if (e.kind == "fault" && told.ns == 0) told = e.when;
  EXPECT_LE(seconds(told - died), (rig.s.safety.beam.frames + 2) * rig.s.capture.frame_period);
}

TEST(BeamWatch, DoesNotMissAStripeThatIsOutOfView) {
  Rig rig;
  rig.in_view = false;
  rig.in_the_sweep = [&] { rig.real.faults.dead = true; };
  EXPECT_TRUE(rig.run().complete());
}

TEST(BeamWatch, IsSilentWhereTheRigFileWantsIt) {
  Rig rig;
  rig.s.safety.beam.verify = false;
  rig.in_the_sweep = [&] { rig.real.faults.dead = true; };
  EXPECT_TRUE(rig.run().complete());
}

/// What a scan is refused with; empty if it is not.
std::string refusal(const std::function<void(Rig&)>& change) {
  Rig rig;
  change(rig);
  try {
    (void)rig.run();
  } catch (const InputError& e) {
    EXPECT_TRUE(rig.sink.states.empty()) << "something moved";
    return e.what();
  }
  return {};
}

TEST(BeamWatch, RefusesAScanWithACameraThatNeverSeesTheDarkAndNamesTheCure) {
  const std::string begin = "camera mono: the beam check does not work: the camera never sees the dark (",
                    end = "); or go without its word: scan: safety: beam: waived: [mono]";
  EXPECT_EQ(refusal([](Rig& rig) { rig.s.capture.dark_frames = 0; }),
            begin + "scan: dark_frames: found 0, expected 1 or more" + end);
  EXPECT_EQ(refusal([](Rig& rig) { rig.record = RecordWhen::kSweep; }),
            begin + "record: found sweep, expected all" + end);
  EXPECT_EQ(refusal([](Rig& rig) {
              rig.s.capture.dark_frames = 0;
              rig.s.safety.beam.verify = false;
            }),
            "");
}

TEST(BeamWatch, RefusesAScanWithACameraWhosePicturesAreTooSmall) {
  const Rig rig;
  const ScanPlan plan = make_scan_plan(rig.s, rig.s.park);
  const auto refusal_of = [&](int width, int height, RecordWhen record) -> std::string {
    try {
      check_witness(plan, rig.s.safety.beam, {"left", width, height}, record);
    } catch (const InputError& e) {
      return e.what();
    }
    return {};
  };
  for (const RecordWhen record : {RecordWhen::kAll, RecordWhen::kDark}) {
    EXPECT_EQ(refusal_of(320, 239, record),
              "camera left: the beam check does not work: no stripe is told in pictures so small (width_px, height_px: "
              "found 320 x 239, expected 240 or more); or go without its word: scan: safety: beam: waived: [left]");
    EXPECT_EQ(refusal_of(320, 240, record), "");
  }
}

TEST(BeamWatch, GoesWithoutACameraThatIsWaivedByNameAndSaysSo) {
  Rig rig;
  rig.s.capture.dark_frames = 0;
  rig.s.safety.beam.waived = {"mono"};
  rig.in_the_sweep = [&] { rig.real.faults.dead = true; };
  const ScanResult result = rig.run();
  EXPECT_TRUE(result.complete()) << result.status;
  EXPECT_TRUE(rig.sink.told("summary", "; waived: mono"));
}

TEST(BeamWatch, LearnsTheDarkFromAsFewPicturesAsTheScanTakes) {
  Rig rig;
  rig.s.capture.dark_frames = 5;
  rig.s.safety.beam.dark_frames = 100;
  rig.in_the_sweep = [&] { rig.real.faults.stuck_on = true; };
  const ScanResult result = rig.run();
  EXPECT_NE(result.status.find("stray beam"), std::string::npos) << result.status;
}

TEST(BeamWatch, EndsAScanOfWhichNoDarkPictureCame) {
  Rig rig;
  LateCamera late(*rig.cameras[1], rig.real);
  rig.second = &late;
  rig.s.safety.camera_timeout = 60;  // it is not silent yet
  const ScanResult result = rig.run();
  EXPECT_NE(result.status.find("camera left: no dark picture arrived"), std::string::npos) << result.status;
  EXPECT_TRUE(rig.sink.of("left", Phase::kSweep).empty());
  EXPECT_TRUE(result.left.safe());
}

/// The rig files' pictures, and small ones of the same.
class BeamWatchOfScale : public testing::TestWithParam<double> {};

TEST_P(BeamWatchOfScale, SaysNothingWrongOnTheSimulatedRigs) {
  int least_lit = std::numeric_limits<int>::max(), most_dark = 0;
  for (const char* name : {"tank-sim", "lab-published"}) {
    const RigConfig rig = load_rig(std::string(TANKRIG_SOURCE_DIR "/etc/rigs/") + name + "/rig.yaml");
    sim::WorldOptions options;
    options.light = 0.5;
    options.noise = 0.1;
    const sim::TankWorld world = sim::TankWorld::load(rig.scene, options);
    const ScanPlan plan = make_scan_plan(rig.scan, rig.scan.park);
    std::uint64_t n = 0;
    const auto seen = [&](const std::string& camera, const JointVector& q, double laser) {
      sim::Exposure e;
      e.q.fill(q);
      e.laser.fill(laser);
      e.mid = Stamp{40'000'000 * static_cast<std::int64_t>(++n)};
      e.index = n;
      cv::Mat image;
      cv::resize(world.render(camera, e), image, {}, GetParam(), GetParam(), cv::INTER_AREA);
      return image;
    };
    int expected = 0;
    for (const RigCamera& camera : rig.cameras) {
      const BeamView view(rig, camera);
      DarkReference dark;
      for (const Segment& segment : plan.segments()) {
        const JointVector q = segment.motion.to();
        for (int i = 0; segment.phase == Phase::kDarkBefore && i < 2; ++i) dark.add(seen(camera.name, q, 0));
        if (segment.phase == Phase::kDarkAfter)
          most_dark = std::max(most_dark, look_for_stripe(seen(camera.name, q, 0), dark.mean())->triples);
      }
      if (camera.record == RecordWhen::kDark) continue;
      for (int i = 0; i <= 3; ++i) {
        JointVector q = rig.scan.posture;
        q[kElbow] = rig.scan.sweep.from + (rig.scan.sweep.to - rig.scan.sweep.from) * i / 3.0;
        most_dark = std::max(most_dark, look_for_stripe(seen(camera.name, q, 0), dark.mean())->triples);
        if (!view.expects_stripe(q)) continue;
        ++expected;
        least_lit = std::min(least_lit, look_for_stripe(seen(camera.name, q, 1), dark.mean())->triples);
      }
    }
    EXPECT_GE(expected, 2) << name << ": nearly nothing was looked at";
  }
  std::printf("%d triples or more with a stripe in view, %d or fewer without\n", least_lit, most_dark);
  EXPECT_GE(least_lit, kAbsent);
  EXPECT_LT(most_dark, kPresent);
}

INSTANTIATE_TEST_SUITE_P(Pictures, BeamWatchOfScale, testing::Values(1, 0.5),
                         [](const auto& scale) { return scale.param == 1 ? "whole" : "small"; });

}  // namespace
}  // namespace tankrig
