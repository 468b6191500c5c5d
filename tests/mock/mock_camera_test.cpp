#include "sim_backends/mock/mock_camera.hpp"

#include <gtest/gtest.h>

#include "sim_backends/mock/mock_lux_meter.hpp"
#include "tests/support/bench_right.hpp"

namespace tankrig::sim {
namespace {

using namespace std::chrono_literals;

/// An arm swinging at constant speed, a laser, and a camera whose pictures are remembered exposures.
struct CameraBench {
  VirtualClock clock;
  MockCameraParameters parameters;
  MockArm arm{arm5e(), {}, (JointVector() << 0, 0.12, 1.0, 0, 0.1).finished(), clock};
  MockLaser laser{0s, clock};
  std::vector<Exposure> seen;

  MockCamera make() {
    return MockCamera({"mono", 4, 3, 1, 25}, parameters, clock, arm, laser,
                      [this](const std::string& name, const Exposure& e) {
                        EXPECT_EQ(name, "mono");
                        seen.push_back(e);
                        return cv::Mat(3, 4, CV_8UC1, cv::Scalar(static_cast<double>(e.index % 256)));
                      });
  }

  /// Runs to `end`, commanding the elbow; returns the frames grabbed on the way.
  std::vector<Frame> run(MockCamera& camera, Duration end) {
    std::vector<Frame> frames;
    JointVector v = JointVector::Zero();
    v[kElbow] = 0.1;
    while (clock.now() < Stamp{} + end) {
      EXPECT_TRUE(drive(arm, v).ok());
      clock.sleep_until(clock.now() + 5ms);
      while (auto frame = camera.try_grab().value()) frames.push_back(std::move(*frame));
    }
    return frames;
  }
};

TEST(MockCamera, StampsMidExposureOnItsOwnGrid) {
  CameraBench bench;
  bench.parameters.phase = 3ms;
  MockCamera sut = bench.make();
  ASSERT_TRUE(sut.start().ok());
  const auto frames = bench.run(sut, 1s);
  ASSERT_GE(frames.size(), 23u);
  for (const Frame& f : frames) {
    EXPECT_EQ(f.stamp.ns, 3'000'000 + static_cast<std::int64_t>(f.sequence) * 40'000'000);
    EXPECT_EQ(f.exposure, 10ms);
    EXPECT_EQ(f.image.at<unsigned char>(0, 0), f.sequence % 256);
  }
}

TEST(MockCamera, DeliversAFrameOnlyAfterExposureAndReadout) {
  CameraBench bench;
  MockCamera sut = bench.make();
  ASSERT_TRUE(sut.start().ok());
  bench.clock.sleep_until({52'999'999});
  EXPECT_EQ(sut.next_frame_at(), Stamp{53'000'000});
  EXPECT_FALSE(sut.try_grab().value());
  bench.clock.sleep_until({53'000'000});
  EXPECT_TRUE(sut.try_grab().value());
}

TEST(MockCamera, SeesArmAndLaserAtThreeInstantsOfTheExposure) {
  CameraBench bench;
  MockCamera sut = bench.make();
  ASSERT_TRUE(sut.start().ok());
  bench.run(sut, 500ms);
  bench.clock.sleep_until({520'000'000});
  ASSERT_TRUE(BenchRight::light(bench.laser).ok());
  bench.run(sut, 600ms);
  const auto during =
      std::find_if(bench.seen.begin(), bench.seen.end(), [](const Exposure& e) { return e.mid == Stamp{520'000'000}; });
  ASSERT_NE(during, bench.seen.end());
  EXPECT_EQ(during->laser, (std::array<double, 3>{0, 1, 1})) << "switched on at mid-exposure";
  const Stamp first = during->mid - 5ms + Duration{10ms} / 6;
  EXPECT_EQ(during->q[0], bench.arm.truth_at(first));
  EXPECT_EQ(during->q[1], bench.arm.truth_at(during->mid));
  EXPECT_NEAR(during->q[2][kElbow] - during->q[0][kElbow], 0.1 * 0.00667, 2e-5);
}

TEST(MockCamera, LeavesAGapInTheSequenceForALostFrame) {
  CameraBench bench;
  bench.parameters.drop_every = 5;
  MockCamera sut = bench.make();
  ASSERT_TRUE(sut.start().ok());
  const auto frames = bench.run(sut, 1s);
  for (const Frame& f : frames) EXPECT_NE(f.sequence % 5, 4u);
  EXPECT_EQ(sut.counters().lost, 5u);
  EXPECT_EQ(sut.counters().delivered, frames.size());
  EXPECT_EQ(bench.seen.size(), frames.size()) << "a lost frame was rendered";
}

TEST(MockCamera, KeepsItsGridWhileStopped) {
  CameraBench bench;
  MockCamera sut = bench.make();
  bench.run(sut, 510ms);
  EXPECT_TRUE(bench.seen.empty());
  ASSERT_TRUE(sut.start().ok());
  const auto frames = bench.run(sut, 700ms);
  ASSERT_FALSE(frames.empty());
  EXPECT_EQ(frames.front().stamp, Stamp{520'000'000});
  EXPECT_EQ(frames.front().sequence, 13u);
  sut.stop();
  EXPECT_TRUE(bench.run(sut, 900ms).empty());
}

TEST(MockCamera, OverrunsItsBufferWhenNobodyGrabs) {
  CameraBench bench;
  bench.parameters.buffer_frames = 2;
  MockCamera sut = bench.make();
  ASSERT_TRUE(sut.start().ok());
  bench.clock.sleep_until({1'000'000'000});
  ASSERT_TRUE(sut.try_grab().value());
  EXPECT_GT(sut.counters().overrun, 20u);
}

TEST(MockLuxMeter, ReadsTheWorldAndItsNoiseIsSeeded) {
  VirtualClock clock;
  clock.sleep_until({7});
  MockLuxMeter exact([] { return 147.0; }, clock);
  EXPECT_EQ(exact.read(1s).value().lux, 147.0);
  EXPECT_EQ(exact.read(1s).value().stamp, Stamp{7});
  MockLuxMeter a([] { return 147.0; }, clock, 0.02, 5), b([] { return 147.0; }, clock, 0.02, 5);
  double sum = 0, squares = 0;
  for (int i = 0; i < 2000; ++i) {
    const double lux = a.read(1s).value().lux;
    EXPECT_EQ(lux, b.read(1s).value().lux);
    sum += lux;
    squares += (lux - 147) * (lux - 147);
  }
  EXPECT_NEAR(sum / 2000, 147, 0.3);
  EXPECT_NEAR(std::sqrt(squares / 2000), 0.02 * 147, 0.2);
}

}  // namespace
}  // namespace tankrig::sim
