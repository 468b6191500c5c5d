// Triggered cameras in a whole scan of the mock rig: where mid-exposures fall, and what becomes of triggers.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "rig/plan/plan_csv.hpp"
#include "session/reading/frame_account.hpp"
#include "session/recording/event_kinds.hpp"
#include "tests/support/mock_rig.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

/// One camera that waits for its triggers; from a trigger to the start of an exposure it takes 3 ms.
struct TriggeredRig : testing_support::MockRig {
  TriggerSettings trigger;
  Duration time_offset{};

  TriggeredRig() {
    trigger = {TriggerMode::kPosition, 4e-3, std::nullopt};
    mock.camera.triggered = true;
    mock.camera.trigger_delay = 3ms;
  }

  ScanResult run() {
    power_on();
    plan = std::make_unique<ScanPlan>(make_scan_plan(s, read_posture(*arm, clock, 1s)));
    ScanJob job{*plan,   s,      clock,
                *arm,    *laser, {{cameras[0].get(), RecordWhen::kAll, {}, trigger, time_offset}},
                sink,    stop,   interlock_closed,
                progress};
    return run_scan(job);
  }

  Stamp plan_zero() const {
    for (const auto& e : sink.events)
      if (e.kind == event_kind::kPlan) return e.when;
    return {};
  }
};

struct Spread {
  double mean = 0, sd = 0;
};

Spread spread(const std::vector<double>& values) {
  Spread s;
  for (const double v : values) s.mean += v / static_cast<double>(values.size());
  for (const double v : values) s.sd += (v - s.mean) * (v - s.mean) / static_cast<double>(values.size());
  s.sd = std::sqrt(s.sd);
  return s;
}

TEST(PositionTrigger, ExposesAtEqualElbowAngles) {
  TriggeredRig rig;
  const ScanResult result = rig.run();
  EXPECT_EQ(result.status, "complete");
  const auto frames = rig.sink.of("mono", Phase::kSweep);
  ASSERT_EQ(frames.size(), 126u) << "one each from the sweep's first angle to its last";
  std::vector<double> off;
  for (std::size_t angle = 0; angle < frames.size(); ++angle) {
    const double lines = (rig.arm->truth_at(frames[angle].stamp)[kElbow] - rig.s.sweep.from) / rig.trigger.spacing;
    off.push_back((lines - static_cast<double>(angle)) * rig.trigger.spacing);
  }
  const Spread s = spread(off);
  std::printf("equal angles: %zu frames %.1f mrad apart, off by %.4f mrad on average, sd %.4f mrad = %.2f %%\n",
              frames.size(), 1e3 * rig.trigger.spacing, 1e3 * s.mean, 1e3 * s.sd, 1e2 * s.sd / rig.trigger.spacing);
  EXPECT_LT(s.sd, 0.02 * rig.trigger.spacing);
  EXPECT_LT(std::abs(s.mean), 0.1e-3);
  EXPECT_EQ(rig.sink.of("mono", Phase::kDarkBefore).size(), 5u);
  EXPECT_EQ(rig.sink.of("mono", Phase::kDarkAfter).size(), 5u);
  EXPECT_TRUE(lost_nothing(result.counts, "mono", result.account.at("mono")));
  EXPECT_EQ(result.counts.at("mono.recorded"), 136u);
  EXPECT_EQ(result.account.at("mono").expected, 136 + result.counts.at("mono.not_recorded"));
}

TEST(PositionTrigger, InterleavesThePassesThereAndBack) {
  TriggeredRig rig;
  rig.s.sweep.passes = 2;
  rig.run();
  std::vector<double> off[2];
  for (const FrameRecord& f : rig.sink.of("mono", Phase::kSweep)) {
    const double lines = (rig.arm->truth_at(f.stamp)[kElbow] - rig.s.sweep.from) / rig.trigger.spacing - 0.5 * f.pass;
    off[f.pass].push_back(lines - std::round(lines));
  }
  for (const auto& pass : off) {
    ASSERT_EQ(pass.size(), &pass == &off[0] ? 126u : 125u) << "between the first pass's angles there is one less";
    EXPECT_LT(std::abs(spread(pass).mean), 0.05);
    EXPECT_LT(spread(pass).sd, 0.03);
  }
}

TEST(SoftwareTrigger, ExposesAtWholePeriodsOfThePlan) {
  TriggeredRig rig;
  rig.trigger = {TriggerMode::kSoftware, 0, 8ms};  // 3 ms and half an exposure
  rig.run();
  const auto frames = rig.sink.of("mono", Phase::kSweep);
  EXPECT_NEAR(static_cast<double>(frames.size()), 125, 1);
  for (const FrameRecord& f : frames) {
    const double periods = seconds(f.stamp - rig.plan_zero()) / 0.04;
    EXPECT_NEAR(periods, std::round(periods), 1e-6);
  }
}

/// Loses all but its first two frames, until it is stopped, without a trace.
class Forgetful final : public Camera {
 public:
  explicit Forgetful(Camera& camera) : camera_(camera) {}
  CameraInfo info() const override { return camera_.info(); }
  Status start() override { return camera_.start(); }
  Result<std::optional<Frame>> try_grab() override {
    auto news = camera_.try_grab();
    if (!forgets_ || !news.ok() || !news.value() || ++given_ <= 2) return news;
    ++forgotten_;
    return std::optional<Frame>();
  }
  std::optional<Stamp> next_frame_at() const override { return camera_.next_frame_at(); }
  void stop() noexcept override {
    if (given_ > 0) forgets_ = false;
    camera_.stop();
  }
  CameraCounters counters() const override {
    CameraCounters c = camera_.counters();
    c.delivered -= forgotten_;
    return c;
  }
  Status trigger() override { return camera_.trigger(); }

 private:
  Camera& camera_;
  bool forgets_ = true;
  int given_ = 0;
  std::uint64_t forgotten_ = 0;
};

TEST(SoftwareTrigger, LostAtTheEndOfABlockIsNoSilenceOfTheNext) {
  TriggeredRig rig;
  rig.power_on();
  rig.plan = std::make_unique<ScanPlan>(make_scan_plan(rig.s, read_posture(*rig.arm, rig.clock, 1s)));
  Forgetful left(*rig.cameras[1]);
  const TriggerSettings software{TriggerMode::kSoftware, 0, std::nullopt};
  ScanJob job{*rig.plan,
              rig.s,
              rig.clock,
              *rig.arm,
              *rig.laser,
              {{rig.cameras[0].get(), RecordWhen::kAll, {}, software}, {&left, RecordWhen::kDark, {}, software}},
              rig.sink,
              rig.stop,
              rig.interlock_closed,
              rig.progress};
  const ScanResult result = run_scan(job);
  EXPECT_EQ(result.status, "complete");
  EXPECT_GE(result.counts.at("left.trigger_lost"), 3u);
  EXPECT_TRUE(rig.sink.told("drop", "left: trigger_lost"));
  EXPECT_EQ(rig.sink.of("left", Phase::kDarkAfter).size(), 5u);
}

TEST(SoftwareTrigger, LearnsTheCamerasDelayInTheDarkBlock) {
  TriggeredRig rig;
  rig.trigger = {TriggerMode::kSoftware, 0, std::nullopt};
  rig.run();
  for (const FrameRecord& f : rig.sink.of("mono", Phase::kSweep)) {
    const double periods = seconds(f.stamp - rig.plan_zero()) / 0.04;
    EXPECT_NEAR(periods, std::round(periods), 1e-6);
  }
}

TEST(Trigger, ThatLeavesNoFrameIsCounted) {
  TriggeredRig rig;
  rig.mock.camera.drop_every = 10;
  const ScanResult result = rig.run();
  EXPECT_TRUE(result.complete()) << result.status;
  EXPECT_NEAR(static_cast<double>(result.counts.at("mono.lost")), 14, 3) << "the driver knows why";
  EXPECT_EQ(result.counts.count("mono.trigger_lost"), 0u) << "and it is counted once";
  EXPECT_TRUE(rig.sink.told("drop", "mono: trigger_lost x 1"));
}

TEST(Trigger, GivesTheSameRecordsTwice) {
  TriggeredRig a, b;
  EXPECT_EQ(a.run().counts, b.run().counts);
  ASSERT_EQ(a.sink.frames.size(), b.sink.frames.size());
  for (std::size_t i = 0; i < a.sink.frames.size(); ++i) {
    EXPECT_EQ(a.sink.frames[i].stamp, b.sink.frames[i].stamp);
    EXPECT_EQ(*a.sink.frames[i].q, *b.sink.frames[i].q);
  }
}

TEST(SyncGate, RefusesWhatItsLimitsDoNotAllowAndSaysWhy) {
  testing_support::MockRig rig;
  rig.s.sync.max_residual = 1.5e-3;
  const ScanResult result = rig.run();
  EXPECT_TRUE(result.complete()) << result.status;
  std::uint64_t refused = 0;
  if (const auto count = result.counts.find("mono.sync_gate"); count != result.counts.end()) refused = count->second;
  EXPECT_GT(refused, 50u);
  EXPECT_TRUE(rig.sink.told("drop", "sync_gate"));
  for (const FrameRecord& f : rig.sink.frames) EXPECT_LE(f.sync_residual, 1500us);
}

TEST(SyncResidual, IsToldInMillimetresOnTheTarget) {
  testing_support::MockRig rig;
  rig.s.target = SyncTarget{rig.model, {{1, 0, 0}, 0.09796}, {-0.26, 0.025, 1.02}};
  const ScanResult result = rig.run();
  EXPECT_TRUE(result.complete());
  double most = 0;
  for (const FrameRecord& f : rig.sink.frames) {
    if (f.phase == Phase::kSweep) {
      // The plane turns about the elbow, some 0.6 to 1.2 m from the object.
      const double per_second = f.sync_residual.count() == 0 ? 0 : f.sync_on_target / seconds(f.sync_residual);
      EXPECT_GT(per_second, 0.1 * 0.4);
      EXPECT_LT(per_second, 0.1 * 1.5);
    } else {
      EXPECT_LT(f.sync_on_target, 1e-5) << "at rest time does not matter";
    }
    most = std::max(most, f.sync_on_target);
  }
  EXPECT_GT(most, 0);
}

TEST(TimeOffset, OfTheRigFileIsTakenOffTheStamps) {
  TriggeredRig rig;
  rig.mock.camera.triggered = false;
  rig.trigger = {};
  rig.mock.camera.stamp_offset = 40ms;
  rig.time_offset = 40ms;
  rig.run();
  const auto frames = rig.sink.of("mono", Phase::kSweep);
  ASSERT_GT(frames.size(), 100u);
  for (const FrameRecord& f : frames)
    EXPECT_EQ((f.stamp.ns - 7'000'000) % 40'000'000, 0) << "not where the camera really exposed";
}

}  // namespace
}  // namespace tankrig
