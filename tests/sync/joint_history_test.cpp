#include "rig/sync/joint_history.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tankrig {
namespace {

using namespace std::chrono_literals;

constexpr double kOmega = 0.1;

JointState sample(Duration t, double jitter = 0) {
  JointState s;
  s.stamp = Stamp{} + t;
  s.q.setConstant(kOmega * seconds(t) + jitter);
  return s;
}

JointHistory ramp(int samples, Duration period = 10ms, std::size_t capacity = 64) {
  JointHistory history(capacity, 50ms);
  for (int i = 0; i < samples; ++i) history.push(sample(period * i));
  return history;
}

TEST(JointHistory, InterpolatesConstantVelocityExactly) {
  const JointHistory sut = ramp(20);
  for (Duration t : {0ns, 1ns, 10000000ns, 12345678ns, 99999999ns, 190000000ns}) {
    const auto joints = sut.interpolate(Stamp{} + t);
    ASSERT_TRUE(joints.ok()) << t.count();
    EXPECT_NEAR(joints.value().q[kElbow], kOmega * seconds(t), 1e-15);
    EXPECT_NEAR(joints.value().velocity[kElbow], kOmega, 1e-12);
  }
}

TEST(JointHistory, ReportsTheDistanceToTheNearerSample) {
  const JointHistory sut = ramp(20);
  EXPECT_EQ(sut.interpolate({20'000'000}).value().residual, 0ms);
  EXPECT_EQ(sut.interpolate({23'000'000}).value().residual, 3ms);
  EXPECT_EQ(sut.interpolate({28'000'000}).value().residual, 2ms);
}

TEST(JointHistory, RefusesToExtrapolate) {
  const JointHistory sut = ramp(20);
  EXPECT_EQ(sut.interpolate({190'000'001}).error().code, ErrorCode::kNotReady);
  EXPECT_EQ(sut.interpolate({-1}).error().code, ErrorCode::kOutOfRange);
  EXPECT_EQ(JointHistory(8, 50ms).interpolate({0}).error().code, ErrorCode::kNotReady);
}

TEST(JointHistory, RefusesAGapInTheSamples) {
  JointHistory sut = ramp(3);
  sut.push(sample(100ms));
  sut.push(sample(110ms));
  EXPECT_EQ(sut.interpolate({50'000'000}).error().code, ErrorCode::kRefused);
  EXPECT_TRUE(sut.interpolate({15'000'000}).ok());
  EXPECT_TRUE(sut.interpolate({105'000'000}).ok());
}

TEST(JointHistory, ForgetsTheOldestWhenFull) {
  const JointHistory sut = ramp(100, 10ms, 16);
  EXPECT_EQ(sut.size(), 16u);
  EXPECT_EQ(sut.interpolate({839'000'000}).error().code, ErrorCode::kOutOfRange);
  EXPECT_NEAR(sut.interpolate({845'000'000}).value().q[kElbow], kOmega * 0.845, 1e-15);
}

TEST(JointHistory, IgnoresASampleThatIsNotNewer) {
  JointHistory sut = ramp(5);
  sut.push(sample(40ms, 1.0));
  sut.push(sample(35ms, 1.0));
  EXPECT_EQ(sut.size(), 5u);
  EXPECT_NEAR(sut.interpolate({40'000'000}).value().q[kElbow], kOmega * 0.04, 1e-15);
}

TEST(JointHistory, FindsTheRightPairAmongIrregularSamples) {
  constexpr unsigned kSeed = 7;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937 random(kSeed);
  JointHistory sut(256, 50ms);
  std::vector<JointState> all;
  Duration t{0};
  for (int i = 0; i < 200; ++i) {
    t += Duration{1'000'000 + static_cast<std::int64_t>(random() % 20'000'000)};
    JointState s;
    s.stamp = Stamp{} + t;
    s.q.setConstant(static_cast<double>(random() % 1000));
    all.push_back(s);
    sut.push(s);
  }
  for (std::size_t i = 0; i + 1 < all.size(); ++i) {
    const Stamp middle = all[i].stamp + (all[i + 1].stamp - all[i].stamp) / 2;
    const double u = seconds(middle - all[i].stamp) / seconds(all[i + 1].stamp - all[i].stamp);
    const auto joints = sut.interpolate(middle);
    ASSERT_TRUE(joints.ok());
    EXPECT_NEAR(joints.value().q[0], all[i].q[0] + u * (all[i + 1].q[0] - all[i].q[0]), 1e-9);
  }
}

}  // namespace
}  // namespace tankrig
