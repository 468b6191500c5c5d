// What the sync gate lets pass: residual and the uncertainty of the stamp together, in milliseconds and on the target.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "rig/capture/frame_joiner.hpp"
#include "tests/support/recording_sink.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr double kVelocity = 0.1;            // of the elbow [rad/s]
constexpr double kAny = 1e9;                 // a limit that refuses nothing
constexpr Duration kResidual = 2ms;          // of every frame: joints come every 10 ms
constexpr Duration kArrivalSigma = 5ms;      // of a stamp that is an arrival and nothing more
const Plane kSheet{{1, 0, 0}, 0.09796};      // in e
const Vector3d kObject(-0.26, 0.025, 1.02);  // in b

ScanSettings settings() {
  ScanSettings s;
  s.park << 0, 0.3, 1.0, 0, 0.1;
  s.posture << 0, 0.12, 0, 0, 0.1;
  s.sweep.from = 1.3, s.sweep.to = 1.8;
  s.target = SyncTarget{arm5e(), kSheet, kObject};
  return s;
}

/// A frame of the sweep, joined to joints that move at kVelocity.
struct JoinedFrame {
  ScanSettings s = settings();
  ScanPlan plan = make_scan_plan(s, s.park);
  JointHistory joints{256, 50ms};
  LaserTimeline laser;
  testing_support::RecordingSink sink;
  Stamp zero{1'000'000'000};
  Stamp stamp;

  JoinedFrame() {
    const auto sweep = std::find_if(plan.segments().begin(), plan.segments().end(),
                                    [](const Segment& segment) { return segment.phase == Phase::kSweep; });
    const Stamp sample = zero + from_seconds(0.5 * (sweep->record_begin + sweep->record_end));
    stamp = sample + kResidual;
    for (int i = -2; i <= 2; ++i) joints.push(state_at(sample + i * 10ms));
    LaserState lit;
    lit.emitting = true;
    laser.add(stamp + 1s, lit);
  }

  JointVector q_at(Stamp when) const {
    JointVector q = s.posture;
    q[kElbow] = 1.5 + kVelocity * seconds(when - stamp);
    return q;
  }
  JointState state_at(Stamp when) const {
    JointState state;
    state.stamp = when;
    state.q = q_at(when);
    return state;
  }
  /// By how much the laser plane moves past the object in that time [m].
  double moves_by(Duration time) const {
    const auto distance = [&](Stamp when) { return (arm5e().bMe(q_at(when)) * kSheet).distance(kObject); };
    return std::abs(distance(stamp + time) - distance(stamp));
  }

  std::map<std::string, std::uint64_t> join(Duration sigma, double max_residual, double max_residual_on_target) {
    s.sync = {max_residual, max_residual_on_target};
    FrameJoiner sut(plan, s, joints, laser, sink);
    sut.start(zero);
    Frame frame;
    frame.image = cv::Mat::zeros(1, 1, CV_8UC1);
    frame.stamp = stamp;
    frame.stamp_sigma = sigma;
    frame.exposure = 5ms;
    sut.add(sut.add_camera("mono", RecordWhen::kAll), frame);
    sut.drain();
    return sut.counts();
  }
};

const std::map<std::string, std::uint64_t> kPassed{{"mono.recorded", 1}}, kRefused{{"mono.sync_gate", 1}};

TEST(SyncGate, CountsTwoSigmaOfTheStampToTheResidualInTime) {
  EXPECT_EQ(JoinedFrame().join(0ms, 2.5e-3, kAny), kPassed);
  EXPECT_EQ(JoinedFrame().join(kArrivalSigma, 12.5e-3, kAny), kPassed);
  JoinedFrame by_arrival;
  EXPECT_EQ(by_arrival.join(kArrivalSigma, 11.5e-3, kAny), kRefused) << "however near the joint sample happens to be";
  EXPECT_TRUE(by_arrival.sink.told("drop", "12.000 ms, of these 2 sigma of its stamp 10.000 ms"));
}

TEST(SyncGate, CountsThemOnTheTargetToo) {
  const double residual = JoinedFrame().moves_by(kResidual),
               both = JoinedFrame().moves_by(kResidual + 2 * kArrivalSigma);
  ASSERT_GT(residual, 0.05e-3);
  EXPECT_EQ(JoinedFrame().join(0ms, kAny, 1.02 * residual), kPassed);
  EXPECT_EQ(JoinedFrame().join(0ms, kAny, 0.98 * residual), kRefused);
  EXPECT_EQ(JoinedFrame().join(kArrivalSigma, kAny, 1.02 * both), kPassed);
  EXPECT_EQ(JoinedFrame().join(kArrivalSigma, kAny, 0.98 * both), kRefused);
}

TEST(SyncGate, LetsAFrameSayHowGoodItsStampIs) {
  JoinedFrame joined;
  joined.join(kArrivalSigma, kAny, kAny);
  ASSERT_EQ(joined.sink.frames.size(), 1u);
  const FrameRecord& frame = joined.sink.frames[0];
  EXPECT_EQ(frame.stamp_sigma, kArrivalSigma);
  EXPECT_EQ(frame.sync_residual, kResidual);
  EXPECT_NEAR(frame.sync_on_target, joined.moves_by(kResidual), 1e-3 * frame.sync_on_target);
}

TEST(SyncGate, HasADefaultThatStampsByArrivalAndWovenPicturesPassAndWorseOnesDoNot) {
  const SyncGate gate;
  EXPECT_EQ(JoinedFrame().join(kArrivalSigma, gate.max_residual, gate.max_residual_on_target), kPassed);
  EXPECT_EQ(JoinedFrame().join(10ms, gate.max_residual, gate.max_residual_on_target), kPassed)
      << "a quarter of a period";
  EXPECT_EQ(JoinedFrame().join(4 * kArrivalSigma, gate.max_residual, gate.max_residual_on_target), kRefused);
}

}  // namespace
}  // namespace tankrig
