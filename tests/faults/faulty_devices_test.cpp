// The devices of the mock rig with a plan before them: unchanged without one, wrong in the right way with one.
#include <gtest/gtest.h>

#include <cmath>

#include "core/input_error.hpp"
#include "sim_backends/faults/faulty_arm.hpp"
#include "sim_backends/faults/faulty_camera.hpp"
#include "sim_backends/faults/faulty_host.hpp"
#include "sim_backends/faults/faulty_laser.hpp"
#include "sim_backends/faults/faulty_lux_meter.hpp"
#include "sim_backends/mock/mock_arm.hpp"
#include "sim_backends/mock/mock_camera.hpp"
#include "sim_backends/mock/mock_lux_meter.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::sim {
namespace {

using namespace std::chrono_literals;

JointVector posture() { return (JointVector() << 0, 0.12, 1.3, 0, 0.1).finished(); }

/// Every device of the mock rig, and a plan of at most one fault, which begins after a second.
struct Devices {
  explicit Devices(const std::string& fault = "") : script(plan_of(fault)) {
    script.mark(FaultOrigin::kStart, clock.now());
  }
  static FaultPlan plan_of(const std::string& fault) {
    if (fault.empty()) return {};
    const TemporaryFolder folder;
    return FaultPlan::load(folder.write("faults.yaml", "faults:\n  - {at_s: 1, " + fault + "}\n"));
  }
  void wait(Duration time) { clock.sleep_until(clock.now() + time); }
  /// The newest state within 30 ms.
  std::optional<JointState> read() {
    std::optional<JointState> newest;
    for (int i = 0; i < 6; ++i) {
      wait(5ms);
      if (auto news = arm.try_read(); news.ok() && news.value()) newest = news.value();
    }
    return newest;
  }

  VirtualClock clock;
  FaultScript script;
  MockArm mock_arm{arm5e(), {}, posture(), clock};
  FaultyArm arm{mock_arm, script, clock};
  MockLaser mock_laser{500ms, clock};
  FaultyLaser laser{mock_laser, script, clock};
  MockCamera mock_camera{
      {"mono", 4, 4, 1, 25}, {}, clock, mock_arm, mock_laser, [](const std::string&, const Exposure& e) {
        return cv::Mat(4, 4, CV_8UC1, cv::Scalar(static_cast<double>(e.index % 100 + 1)));
      }};
  FaultyCamera camera{mock_camera, script, clock};
  MockLuxMeter mock_meter{[] { return 60.0; }, clock};
  FaultyLuxMeter meter{mock_meter, script, clock};
  FaultyHost host{script, clock};
};

TEST(FaultyArm, IsTheArmItselfWithoutAPlan) {
  Devices plain, wrapped;
  const JointVector v = (JointVector() << 0, 0, 0.1, 0, 0).finished();
  for (int i = 0; i < 500; ++i) {
    plain.wait(5ms), wrapped.wait(5ms);
    const auto a = plain.mock_arm.try_read(), b = wrapped.arm.try_read();
    ASSERT_EQ(a.value().has_value(), b.value().has_value());
    if (a.value()) {
      ASSERT_EQ(a.value()->q, b.value()->q);
      ASSERT_EQ(a.value()->stamp, b.value()->stamp);
    }
    ASSERT_EQ(drive(plain.mock_arm, v).value(), drive(wrapped.arm, v).value());
  }
  EXPECT_TRUE(wrapped.arm.stop().ok());
}

TEST(FaultyArm, ReadsTheElbowWronglyByTheAmount) {
  Devices d("device: arm, kind: wrong, amount: 0.2");
  EXPECT_NEAR(d.read()->q[kElbow], 1.3, 1e-3);
  d.wait(1s);
  EXPECT_NEAR(d.read()->q[kElbow], 1.5, 1e-3);
}

TEST(FaultyArm, TellsEveryWayNotToBeThere) {
  const auto after = [](const std::string& kind, auto check) {
    Devices d("device: arm, kind: " + kind);
    d.wait(2s);
    check(d);
  };
  const JointVector rest = JointVector::Zero();
  after("off", [&](Devices& d) { EXPECT_FALSE(d.read()); });
  after("unplugged", [&](Devices& d) {
    EXPECT_EQ(d.arm.try_read().error().code, ErrorCode::kDisconnected);
    EXPECT_EQ(drive(d.arm, rest).error().code, ErrorCode::kDisconnected);
    EXPECT_EQ(d.arm.stop().error().code, ErrorCode::kDisconnected);
  });
  after("bus_off", [&](Devices& d) {
    EXPECT_FALSE(d.read());
    EXPECT_STREQ(d.arm.stop().error().where, "arm: bus-off");
  });
  after("enobufs", [&](Devices& d) {
    EXPECT_TRUE(drive(d.arm, rest).ok()) << "an ordinary outcome: again in the next cycle";
    EXPECT_EQ(d.arm.stop().error().os_errno, ENOBUFS);
  });
  after("write_error", [&](Devices& d) {
    EXPECT_TRUE(d.read());
    EXPECT_EQ(d.arm.stop().error().code, ErrorCode::kIo);
  });
}

TEST(FaultyArm, FreezesItsAnglesButNotItsStamps) {
  Devices d("device: arm, kind: stuck");
  (void)d.read();
  d.wait(1s);
  const JointState first = *d.read();
  (void)drive(d.arm, (JointVector() << 0, 0, 0.1, 0, 0).finished());
  d.wait(300ms);
  const JointState second = *d.read();
  EXPECT_EQ(first.q, second.q);
  EXPECT_GT(second.stamp, first.stamp);
  EXPECT_GT(d.mock_arm.truth_at(d.clock.now())[kElbow], 1.31);
}

TEST(FaultyLaser, AlwaysTakesOffAndOpensByItsWatchdogWhenItsLineIsGone) {
  Devices d("device: laser, kind: unplugged");
  ASSERT_TRUE(BenchRight::light(d.laser).ok());
  d.wait(1100ms);
  EXPECT_EQ(d.laser.state().error().code, ErrorCode::kDisconnected);
  EXPECT_TRUE(d.laser.off().ok());
  EXPECT_FALSE(BenchRight::light(d.laser).ok());
  EXPECT_TRUE(d.mock_laser.state().value().powered);
  d.wait(FaultyLaser::kWatchdog);
  (void)d.laser.state();
  EXPECT_FALSE(d.mock_laser.state().value().powered);
}

TEST(FaultyLaser, WeldsWhereItIsClosed) {
  Devices d("device: laser, kind: stuck");
  ASSERT_TRUE(BenchRight::light(d.laser).ok());
  d.wait(2s);
  ASSERT_TRUE(d.laser.off().ok());
  EXPECT_TRUE(d.laser.state().value().powered);
  EXPECT_FALSE(d.laser.state().value().commanded);
}

TEST(FaultyLaser, LosesItsLightWithAGoodReadBack) {
  Devices d("device: beam, kind: off");
  ASSERT_TRUE(BenchRight::light(d.laser).ok());
  d.wait(2s);
  EXPECT_TRUE(d.laser.state().value().emitting);
  EXPECT_EQ(d.mock_laser.power_at(d.clock.now()), 0);
}

int grabbed(Devices& d, Duration time, std::vector<int>* pixels = nullptr) {
  int count = 0;
  for (const Stamp end = d.clock.now() + time; d.clock.now() < end; d.wait(5ms)) {
    auto news = d.camera.try_grab();
    if (!news.ok() || !news.value()) continue;
    ++count;
    if (pixels) pixels->push_back(news.value()->image.at<unsigned char>(0, 0));
  }
  return count;
}

TEST(FaultyCamera, LosesItsShareOfFramesWithAGapInTheirNumbers) {
  Devices d("device: camera mono, kind: dropped, ratio: 0.2, seed: 3");
  ASSERT_TRUE(d.camera.start().ok());
  const int all = grabbed(d, 1s);
  EXPECT_GE(all, 24);
  const int some = grabbed(d, 20s);
  EXPECT_NEAR(some, 400, 40);
  EXPECT_EQ(d.camera.counters().lost, static_cast<std::uint64_t>(500 - some));
  EXPECT_EQ(d.camera.counters().delivered, static_cast<std::uint64_t>(all + some));
}

TEST(FaultyCamera, RepeatsItsPictureAndGoesBlack) {
  Devices stuck("device: camera, kind: stuck"), black("device: camera, kind: wrong");
  for (Devices* d : {&stuck, &black}) {
    ASSERT_TRUE(d->camera.start().ok());
    grabbed(*d, 1100ms);
  }
  std::vector<int> seen, dark;
  grabbed(stuck, 400ms, &seen);
  grabbed(black, 400ms, &dark);
  ASSERT_EQ(seen.size(), 10u);
  EXPECT_EQ(seen, std::vector<int>(10, seen[0]));
  EXPECT_EQ(dark, std::vector<int>(10, 0));
}

TEST(FaultyCamera, IsOneTimeOutWhenItSendsNothing) {
  Devices d("device: camera mono, kind: off");
  ASSERT_TRUE(d.camera.start().ok());
  grabbed(d, 1s);
  int errors = 0;
  for (int i = 0; i < 120; ++i, d.wait(5ms)) errors += !d.camera.try_grab().ok();
  EXPECT_EQ(errors, 1);
}

TEST(FaultyLuxMeter, SaysWhatIsWrong) {
  const auto reading = [](const std::string& fault) {
    Devices d("device: lux_meter, kind: " + fault);
    (void)d.meter.read(1s);
    d.wait(2s);
    return d.meter.read(1s);
  };
  EXPECT_EQ(reading("off").error().code, ErrorCode::kTimeout);
  EXPECT_EQ(reading("unplugged").error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(reading("garbage").error().code, ErrorCode::kProtocol);
  EXPECT_DOUBLE_EQ(reading("wrong, amount: 0.5").value().lux, 90);
  EXPECT_TRUE(reading("slow, delay_s: 0.5").ok());
  EXPECT_FALSE(reading("slow, delay_s: 1.5").ok());
}

TEST(FaultyHost, FillsTheDiskOpensTheLoopAndDies) {
  Devices full("device: disk, kind: disk_full"), open("device: interlock, kind: off"),
      dead("device: supervisor, kind: off");
  full.host.write(false);
  EXPECT_TRUE(open.host.interlock(true));
  dead.host.round();
  for (Devices* d : {&full, &open, &dead}) d->wait(2s);
  EXPECT_EQ(message_of<InputError>([&] { full.host.write(false); }), "session: No space left on device");
  EXPECT_FALSE(open.host.interlock(true));
  EXPECT_THROW(dead.host.round(), std::runtime_error);
}

}  // namespace
}  // namespace tankrig::sim
