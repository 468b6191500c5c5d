// The joints' limits in a whole scan: what is told, and that laser and arm are off.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/mock_rig.hpp"

namespace tankrig::testing_support {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using Alter = std::function<void(JointState&)>;

/// The mock arm, lying about its state once a scan sweeps.
class LyingArm final : public Arm {
 public:
  LyingArm(Arm& arm, Alter alter) : arm_(arm), alter_(std::move(alter)) {}
  Result<std::optional<JointState>> try_read() noexcept override {
    auto news = arm_.try_read();
    if (lies && news.ok() && news.value()) alter_(*news.value());
    return news;
  }
  Result<JointVector> write_velocity(const OutputRight& right, const JointVector& v) noexcept override {
    return arm_.write_velocity(right, v);
  }
  Status stop() noexcept override { return arm_.stop(); }
  Duration exchange_period() const noexcept override { return arm_.exchange_period(); }

  bool lies = false;

 private:
  Arm& arm_;
  Alter alter_;
};

/// How a scan ends whose arm lies.
std::string status_with(const Alter& alter, const std::function<void(ScanSettings&)>& set = {}) {
  MockRig rig;
  if (set) set(rig.s);
  rig.power_on();
  LyingArm arm(*rig.arm, alter);
  const ScanPlan plan = make_scan_plan(rig.s, rig.s.park);
  const auto lie = [&](const ScanProgress& p) { arm.lies = p.phase == Phase::kSweep; };
  ScanJob job{plan, rig.s, rig.clock, arm, *rig.laser, {}, rig.sink, rig.stop, rig.interlock_closed, lie};
  const ScanResult result = run_scan(job);
  EXPECT_FALSE(rig.laser->state().value().powered);
  EXPECT_EQ(rig.arm->true_velocity_at(rig.clock.now()).cwiseAbs().maxCoeff() < 1e-2, true);
  EXPECT_TRUE(rig.sink.told("fault", result.status.substr(std::string("stopped: ").size())));
  return result.status;
}

TEST(JointLimits, ACurrentThatStaysHighStopsTheScan) {
  EXPECT_EQ(status_with([](JointState& s) { s.current_a = 2.4; }),
            "stopped: over-current: the arm takes 2.40 A for too long, limit 2.00 in \"sweep pass 0\"");
}

TEST(JointLimits, AJointBeyondItsLimitStopsTheScan) {
  EXPECT_EQ(status_with([](JointState& s) { s.q[kShoulder] = -0.04; }),
            "stopped: joint limit: shoulder at -0.0400 rad, limit 0.0000 in \"sweep pass 0\"");
}

TEST(JointLimits, AJointThatIsTooFastStopsTheScan) {
  EXPECT_THAT(status_with([n = 0](JointState& s) mutable { s.ticks[kSlew] += 30 * ++n; }),
              StartsWith("stopped: joint too fast: slew at 2700 ticks/s, limit 2200"));
}

TEST(JointLimits, AJointDrivenOnTowardsALimitThatItsPlanKeepsAwayFromStopsTheScan) {
  const auto near_its_stop = [](JointState& s) { s.q[kElbow] = 2.11; };
  EXPECT_THAT(status_with(near_its_stop,
                          [](ScanSettings& s) {
                            s.control.following_error_limit = 1;
                            s.limits.velocity = 100;
                            s.control.position_gain = 0;
                          }),
              HasSubstr("joint limit: elbow driven on at 2.1100 rad, refused beyond 2.1029"));
}

TEST(JointLimits, AParkPostureAtAJointsLimitIsReachedAndLeft) {
  MockRig rig;
  rig.s.park[kShoulder] = rig.model.limits[kShoulder].lower;
  rig.s.park[kElbow] = rig.model.limits[kElbow].upper;
  EXPECT_EQ(rig.run().status, "complete");
  EXPECT_NEAR(rig.arm->truth_at(rig.clock.now())[kElbow], rig.s.park[kElbow], 0.01);
}

}  // namespace
}  // namespace tankrig::testing_support
