// A machine that is suspended in the middle of a scan, in virtual time: no time-out sees it, and the scan ends all the
// same.
#include <gtest/gtest.h>

#include "tests/support/mock_rig.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using testing_support::MockRig;

/// What happened from the suspension on.
struct SuspendedRig : MockRig {
  Stamp suspended{};

  ScanResult suspended_in(Phase phase, double fraction) {
    progress = [this, phase, fraction](const ScanProgress& p) {
      if (suspended.ns != 0 || p.phase != phase || p.fraction < fraction) return;
      suspended = clock.now();
      clock.suspend(8h);
    };
    return run();
  }
};

TEST(Suspension, EndsTheScanInTheNextCycleLaserFirst) {
  for (const auto& [phase, fraction] : {std::pair{Phase::kSweep, 0.5}, std::pair{Phase::kMove, 0.01}}) {
    SCOPED_TRACE(to_string(phase));
    SuspendedRig rig;
    const ScanResult result = rig.suspended_in(phase, fraction);
    ASSERT_GT(rig.suspended.ns, 0);
    EXPECT_TRUE(result.status.starts_with("stopped: machine suspended")) << result.status;
    EXPECT_TRUE(result.left.safe());
    const Stamp next = rig.suspended + from_seconds(1.5 / rig.s.cycle_hz);
    Stamp dark{}, told{};
    for (const auto& e : rig.sink.events) {
      if (e.kind == "laser" && e.text == "off") dark = e.when;
      if (e.kind == "fault" && told.ns == 0) told = e.when;
    }
    EXPECT_LE(told, next);
    if (phase == Phase::kSweep) {
      EXPECT_LE(dark, next);
      EXPECT_GT(dark.ns, 0);
    }
    EXPECT_LT(rig.arm->true_velocity_at(rig.clock.now()).cwiseAbs().maxCoeff(), rig.s.safety.rest_velocity);
  }
}

TEST(Suspension, BeforeTheScanIsNobodysConcern) {
  MockRig rig;
  rig.clock.suspend(8h);
  EXPECT_TRUE(rig.run().complete());
}

}  // namespace
}  // namespace tankrig
