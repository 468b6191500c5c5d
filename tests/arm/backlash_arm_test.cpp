#include "drivers/arm/backlash_arm.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/bench_right.hpp"

namespace tankrig {
namespace {

/// Has its encoders where it is put, and knows its angles from them.
class PutArm final : public Arm {
 public:
  Result<std::optional<JointState>> try_read() noexcept override {
    if (fails) return Error{ErrorCode::kIo, 0, {}, "arm: read"};
    if (silent) return std::optional<JointState>{};
    JointState s;
    s.stamp = Stamp{++count};
    s.ticks = ticks;
    for (int j = 0; j < kJoints; ++j)
      s.q[j] = homed ? model.actuators[static_cast<std::size_t>(j)].angle(ticks[static_cast<std::size_t>(j)])
                     : std::numeric_limits<double>::quiet_NaN();
    return std::optional<JointState>(s);
  }
  Result<JointVector> write_velocity(const OutputRight&, const JointVector& v) noexcept override {
    return JointVector(2 * v);
  }
  Status stop() noexcept override { return Error{ErrorCode::kIo, 0, {}, "arm: stop"}; }
  Duration exchange_period() const noexcept override { return Duration{7}; }
  Statistics statistics() const override { return {{"count", 1.0}}; }

  ArmModel model = arm5e();
  std::array<std::int32_t, kJoints> ticks{6000, 3000, 8000, 0, 200};
  bool homed = true, silent = false, fails = false;
  std::int64_t count = 0;
};

struct BacklashBench {
  PutArm arm;
  BacklashArm sut{arm, arm.model, {0, 0, 30, 0, 0}};

  /// Puts the elbow's encoder there; where its link is said to be [ticks].
  double link(int ticks) {
    arm.ticks[kElbow] = ticks;
    const auto news = sut.try_read();
    return arm.model.actuators[kElbow].ticks(news.value()->q[kElbow]);
  }
};

TEST(BacklashArm, LetsTheLinkTrailByHalfThePlayBehindItsLastMotion) {
  BacklashBench bench;
  EXPECT_NEAR(bench.link(8000), 8000, 1e-6) << "nothing is known yet";
  EXPECT_NEAR(bench.link(8010), 8000, 1e-6) << "within the backlash";
  EXPECT_NEAR(bench.link(8100), 8085, 1e-6);
  EXPECT_NEAR(bench.link(8090), 8085, 1e-6) << "turned around, still within the backlash";
  EXPECT_NEAR(bench.link(8071), 8085, 1e-6);
  EXPECT_NEAR(bench.link(8000), 8015, 1e-6);
}

TEST(BacklashArm, ChangesNothingElse) {
  BacklashBench bench;
  (void)bench.link(8000);
  bench.arm.ticks = {5000, 2000, 7000, 40, 300};
  const JointState bare = *bench.arm.try_read().value(), state = *bench.sut.try_read().value();
  for (const int j : {kSlew, kShoulder, kJawRotate, kJawOpening}) EXPECT_EQ(state.q[j], bare.q[j]);
  EXPECT_NE(state.q[kElbow], bare.q[kElbow]);
  EXPECT_EQ(state.ticks, bare.ticks);
  EXPECT_EQ(drive(bench.sut, JointVector::Ones()).value(), JointVector(2 * JointVector::Ones()));
  EXPECT_EQ(bench.sut.stop().error().code, ErrorCode::kIo);
  EXPECT_EQ(bench.sut.exchange_period(), Duration{7});
  EXPECT_EQ(bench.sut.statistics().size(), 1u);
  bench.arm.silent = true;
  EXPECT_FALSE(bench.sut.try_read().value());
  bench.arm.fails = true;
  EXPECT_EQ(bench.sut.try_read().error().code, ErrorCode::kIo);
}

TEST(BacklashArm, InventsNoAngleForAnArmThatIsNotHomed) {
  BacklashBench bench;
  bench.arm.homed = false;
  EXPECT_TRUE(std::isnan(bench.sut.try_read().value()->q[kElbow]));
}

}  // namespace
}  // namespace tankrig
