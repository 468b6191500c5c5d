// When people are told what to cut: in virtual time, in the very turn in which a stop does not arrive.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/mock_rig.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using ::testing::StartsWith;
using testing_support::MockRig;

constexpr char kCutLaser[] = "LASER MAY BE ON: cut its supply", kCutArm[] = "ARM MAY BE MOVING: cut its power";

/// A scan that is stopped in its sweep, where something goes wrong too.
struct StoppedRig : MockRig {
  struct Told {
    Stamp when;
    std::string what;
  };
  std::vector<Told> told;
  Stamp stopped{};

  StoppedRig() {
    cut = [this](const std::string& what) { told.push_back({clock.now(), what}); };
  }
  ScanResult stop_where(std::function<void(StoppedRig&)> goes_wrong) {
    progress = [this, goes_wrong](const ScanProgress& p) {
      if (stopped.ns != 0 || p.phase != Phase::kSweep || p.fraction < 0.5) return;
      stopped = clock.now();
      stop = true;
      goes_wrong(*this);
    };
    return run();
  }
  Duration after(std::size_t i) const { return told.at(i).when - stopped; }
  Duration turns(int count) const { return from_seconds(count / s.cycle_hz); }
};

TEST(WhatToCut, IsNotSaidOfAStopThatArrivesNorOfAPlansEnd) {
  StoppedRig stopped, whole;
  EXPECT_TRUE(stopped.stop_where([](StoppedRig&) {}).left.safe());
  EXPECT_TRUE(whole.run().complete());
  EXPECT_TRUE(stopped.told.empty());
  EXPECT_TRUE(whole.told.empty());
}

TEST(WhatToCut, IsSaidInTheTurnInWhichTheArmsStopIsNotTakenAndTakenBackWhenItRestsAfterAll) {
  StoppedRig rig;
  const ScanResult result = rig.stop_where([](StoppedRig& r) { r.arm->faults.stop_fails = true; });
  ASSERT_EQ(rig.told.size(), 2u);
  EXPECT_EQ(rig.told[0].what, kCutArm);
  EXPECT_LE(rig.after(0), rig.turns(2));
  EXPECT_EQ(rig.told[1].what, "") << "its watchdog stopped it";
  EXPECT_TRUE(result.left.safe());
}

TEST(WhatToCut, IsSaidInTheTurnInWhichTheLaserDoesNotTakeOff) {
  StoppedRig rig;
  const ScanResult result = rig.stop_where([](StoppedRig& r) { r.laser->faults.set_fails = true; });
  ASSERT_EQ(rig.told.size(), 1u) << "and it is never over";
  EXPECT_EQ(rig.told[0].what, kCutLaser);
  EXPECT_LE(rig.after(0), rig.turns(2));
  EXPECT_FALSE(result.left.laser_dark);
}

TEST(WhatToCut, IsTheLaserAloneOnceTheArmRests) {
  StoppedRig rig;
  const ScanResult result = rig.stop_where([](StoppedRig& r) {
    r.laser->faults.set_fails = true;
    r.arm->faults.stop_fails = true;
  });
  ASSERT_GE(rig.told.size(), 2u);
  EXPECT_EQ(rig.told.back().what, kCutLaser);
  EXPECT_TRUE(result.left.arm_at_rest);
}

TEST(WhatToCut, IsSaidAfterASecondOfDevicesThatTakeTheStopAndDoNotObey) {
  StoppedRig rig;
  const ScanResult result = rig.stop_where([](StoppedRig& r) {
    r.arm->faults.runs_away = true;
    r.laser->faults.stuck_on = true;
  });
  ASSERT_EQ(rig.told.size(), 2u);
  EXPECT_EQ(rig.told[0].what, std::string(kCutLaser) + "; " + kCutArm);
  EXPECT_LE(rig.after(0), SafeEnd::kUsual + rig.turns(3));
  EXPECT_LT(rig.after(0), from_seconds(rig.s.safety.rest_timeout));
  EXPECT_EQ(rig.told[1].what, kCutLaser) << "the arm rests at the end of its way";
  EXPECT_FALSE(result.left.safe());
}

/// Another device whose line is gone from some moment on.
class DisconnectedArm final : public Arm {
 public:
  explicit DisconnectedArm(Arm& arm) : arm_(arm) {}
  Result<std::optional<JointState>> try_read() noexcept override {
    if (lost) return Error{ErrorCode::kDisconnected, 0, {}, "arm: carrier lost"};
    return arm_.try_read();
  }
  Result<JointVector> write_velocity(const OutputRight& right, const JointVector& v) noexcept override {
    return arm_.write_velocity(right, v);
  }
  Status stop() noexcept override {
    if (lost) return Error{ErrorCode::kDisconnected, 0, {}, "arm: carrier lost"};
    return arm_.stop();
  }
  Duration exchange_period() const noexcept override { return arm_.exchange_period(); }

  bool lost = false;

 private:
  Arm& arm_;
};

class LostLaser final : public Laser {
 public:
  explicit LostLaser(Laser& laser) : laser_(laser) {}
  Status set(bool on) noexcept override { return Laser::set(laser_, on); }  // taken by its thread
  Result<LaserState> state() noexcept override {
    if (lost) return Error{ErrorCode::kDisconnected, 0, {}, "laser relay: read state"};
    return laser_.state();
  }
  Duration warm_up() const noexcept override { return laser_.warm_up(); }

  bool lost = false;

 private:
  Laser& laser_;
};

/// As where the process that emulates them is killed; the sink may fail at the same time.
TEST(WhatToCut, IsSaidInTheTurnInWhichBothDevicesAreLostAlsoWhereTheDiskFailsWithThem) {
  for (const bool disk_too : {false, true}) {
    SCOPED_TRACE(disk_too ? "and the disk" : "devices");
    StoppedRig rig;
    rig.power_on();
    DisconnectedArm arm(*rig.arm);
    LostLaser laser(*rig.laser);
    rig.sink.on_frame = [&](const FrameRecord& frame) {
      if (rig.stopped.ns != 0 || frame.phase != Phase::kSweep || frame.index < 30) return;
      rig.stopped = rig.clock.now();
      arm.lost = laser.lost = true;
      if (disk_too) throw std::runtime_error("disk full");
    };
    rig.plan = std::make_unique<ScanPlan>(make_scan_plan(rig.s, read_posture(*rig.arm, rig.clock, 1s)));
    ScanJob job{*rig.plan, rig.s,    rig.clock,
                arm,       laser,    {{rig.cameras[0].get(), RecordWhen::kAll}},
                rig.sink,  rig.stop, rig.interlock_closed,
                {},        rig.cut};
    if (disk_too)
      EXPECT_THROW(run_scan(job), std::runtime_error);
    else
      EXPECT_THAT(run_scan(job).status, StartsWith("stopped: arm read failed"));
    ASSERT_EQ(rig.told.size(), 1u);
    EXPECT_EQ(rig.told[0].what, std::string(kCutLaser) + "; " + kCutArm);
    EXPECT_LE(rig.after(0), rig.turns(2));
  }
}

}  // namespace
}  // namespace tankrig
