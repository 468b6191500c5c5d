// The Aravis driver against emulated GigE Vision cameras on loopback: pictures, stamps, triggers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>

#include "core/input_error.hpp"
#include "drivers/camera/aravis_socket.hpp"
#include "tests/camera/gige_rig.hpp"
#include "tests/support/machine_witness.hpp"
#include "tests/support/sanitizers.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::testing {
namespace {

using sim::GigeCameraEmulator;
using sim::GigeCameraSettings;

const cv::Size kSize(320, 240);

GigeCameraSettings emulated() {
  GigeCameraSettings s;
  s.width = kSize.width;
  s.height = kSize.height;
  s.rate_hz = 150;
  s.exposure_us = 4000;
  s.clock_drift_ppm = 40;
  return s;
}

AravisSettings driven(int channels = 1) {
  AravisSettings s;
  s.info = {"left", kSize.width, kSize.height, channels, 150};
  s.address = "127.0.0.1";
  s.exposure_us = 4000;
  s.packet_size = 9000;
  return s;
}

sim::GigePicture known(int channels) {
  return [channels](std::uint64_t index, Stamp, Duration) { return known_picture(index, kSize, channels); };
}

class AravisCameraTest : public GigeTest {};

TEST_F(AravisCameraTest, DeliversMono8PicturesPixelForPixel) {
  GigeCameraEmulator emulator(emulated(), known(1));
  AravisCamera sut(driven());
  ASSERT_TRUE(sut.start().ok());
  const std::vector<Frame> frames = grab_frames(sut, 20);
  ASSERT_EQ(frames.size(), 20u);
  for (const Frame& f : frames) {
    EXPECT_EQ(cv::norm(f.image, known_picture(known_index(f), kSize, 1), cv::NORM_INF), 0) << "frame " << f.sequence;
    EXPECT_EQ(f.exposure, std::chrono::microseconds(4000));
  }
}

TEST_F(AravisCameraTest, DeliversRgb8PicturesPixelForPixelAsBgr) {
  GigeCameraSettings device = emulated();
  device.pixel_format = "RGB8";
  GigeCameraEmulator emulator(device, known(3));
  AravisCamera sut(driven(3));
  ASSERT_TRUE(sut.start().ok());
  const std::vector<Frame> frames = grab_frames(sut, 10);
  ASSERT_EQ(frames.size(), 10u);
  for (const Frame& f : frames)
    EXPECT_EQ(cv::norm(f.image, known_picture(known_index(f), kSize, 3), cv::NORM_INF), 0) << "frame " << f.sequence;
}

TEST_F(AravisCameraTest, MissesNotEvenTheFirstFrameThoughItIsLargerThanAReceiveBufferUsuallyIs) {
  const cv::Size large(1280, 960);
  GigeCameraSettings device = emulated();
  device.width = large.width;
  device.height = large.height;
  device.rate_hz = 10;
  GigeCameraEmulator emulator(
      device, [&](std::uint64_t index, Stamp, Duration) { return cv::Mat(large, CV_8UC1, cv::Scalar(1.0 + index)); });
  AravisSettings settings = driven();
  settings.info = {"left", large.width, large.height, 1, 10};
  settings.socket = AravisSettings::Socket::kDatagram;
  AravisCamera sut(settings);
  ASSERT_TRUE(sut.start().ok());
  const std::vector<Frame> frames = grab_frames(sut, 1);
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].image.data[0], 1) << "the camera's first exposure";
  EXPECT_EQ(sut.counters().incomplete, 0u);
}

/// Error of each frame's stamp against the emulator's truth [ms], sorted, and in sigmas.
struct StampErrors {
  std::vector<double> ms, normalised;
  double quantile(double q) const { return ms[static_cast<std::size_t>(q * static_cast<double>(ms.size() - 1))]; }
};

StampErrors stamp_errors(const std::vector<Frame>& frames, const TruthLog& truth) {
  StampErrors errors;
  for (const Frame& f : frames) {
    const std::optional<Stamp> middle = truth.middle(known_index(f));
    if (!middle) {
      ADD_FAILURE() << "frame " << f.sequence << " was never exposed";
      continue;
    }
    errors.ms.push_back(std::abs(seconds(f.stamp - *middle)) * 1e3);
    errors.normalised.push_back(seconds(f.stamp - *middle) / seconds(f.stamp_sigma));
  }
  std::sort(errors.ms.begin(), errors.ms.end());
  std::cout << "stamp error: median " << errors.quantile(0.5) << " ms, p90 " << errors.quantile(0.9) << " ms, largest "
            << errors.ms.back() << " ms of " << errors.ms.size() << "\n";
  return errors;
}

TEST_F(AravisCameraTest, StampsMidExposureThroughTheTimestampLatch) {
  TruthLog truth;
  GigeCameraSettings device = emulated();
  device.clock_drift_ppm = 80;
  GigeCameraEmulator emulator(device, known(1), truth.writer());
  AravisCamera sut(driven());
  ASSERT_TRUE(sut.start().ok());
  const std::vector<Frame> frames = grab_frames(sut, 200);
  ASSERT_EQ(frames.size(), 200u);
  const StampErrors errors = stamp_errors(frames, truth);
  EXPECT_LT(errors.quantile(0.5), 0.5);
  EXPECT_LT(errors.quantile(0.9), 2.0);
  for (const Frame& f : frames) EXPECT_GT(f.stamp_sigma, Duration{});
  std::vector<double> sigmas = errors.normalised;
  for (double& z : sigmas) z = std::abs(z);
  std::nth_element(sigmas.begin(), sigmas.begin() + 100, sigmas.end());
  EXPECT_LT(sigmas[100], 3) << "the sigma is honest";
  EXPECT_EQ(statistic(sut, "timestamp_latch"), 1);
  EXPECT_GT(emulator.latches(), 8u);
  EXPECT_GT(statistic(sut, "latch_round_trip_us"), 0);
  std::cout << "latch round trip " << statistic(sut, "latch_round_trip_us") << " us, drift "
            << statistic(sut, "clock_drift_ppm") << " +- " << statistic(sut, "clock_drift_sigma_ppm")
            << " ppm, stamp sigma " << statistic(sut, "stamp_sigma_us") << " us\n";
}

TEST_F(AravisCameraTest, StampsByTheEarliestArrivalsWhereThereIsNoLatchAndSaysSo) {
  TruthLog truth;
  GigeCameraSettings device = emulated();
  device.timestamp_latch = false;
  GigeCameraEmulator emulator(device, known(1), truth.writer());
  AravisSettings settings = driven();
  settings.transfer_delay = std::chrono::microseconds(300);
  settings.transfer_delay_sigma = std::chrono::milliseconds(1);
  AravisCamera sut(settings);
  ASSERT_TRUE(sut.start().ok());
  std::vector<Frame> frames = grab_frames(sut, 200);
  ASSERT_EQ(frames.size(), 200u);
  EXPECT_EQ(statistic(sut, "timestamp_latch"), 0);
  const double by_arrival = statistic(sut, "stamps_by_arrival");
  EXPECT_GT(by_arrival, 0) << "until the envelope has its first sample";
  EXPECT_LT(by_arrival, 50);
  frames.erase(frames.begin(), frames.begin() + 60);
  const StampErrors errors = stamp_errors(frames, truth);
  EXPECT_LT(errors.quantile(0.5), 2.0 * testing_support::kSlowness);
  for (const Frame& f : frames) EXPECT_GE(f.stamp_sigma, std::chrono::milliseconds(1));
}

TEST_F(AravisCameraTest, TurnsEachKindOfDeviceStampIntoMidExposure) {
  // The emulator stamps the start of the exposure; told that it is something else, the stamp moves by what that means.
  const auto offset_of = [&](AravisSettings::StampAt at, Duration readout) {
    TruthLog truth;
    GigeCameraEmulator emulator(emulated(), known(1), truth.writer());
    AravisSettings settings = driven();
    settings.stamp_at = at;
    settings.readout = readout;
    AravisCamera sut(settings);
    EXPECT_TRUE(sut.start().ok());
    std::vector<double> ms;
    for (const Frame& f : grab_frames(sut, 21)) ms.push_back(seconds(f.stamp - *truth.middle(known_index(f))) * 1e3);
    std::sort(ms.begin(), ms.end());
    return ms.size() == 21 ? ms[10] : 1e9;
  };
  using StampAt = AravisSettings::StampAt;
  EXPECT_NEAR(offset_of(StampAt::kExposureStart, {}), 0, 1);
  EXPECT_NEAR(offset_of(StampAt::kExposureEnd, {}), -4, 1);
  EXPECT_NEAR(offset_of(StampAt::kTransferStart, std::chrono::milliseconds(3)), -7, 1);
}

TEST_F(AravisCameraTest, FollowsADeviceClockThatIsSet) {
  TruthLog truth;
  GigeCameraEmulator emulator(emulated(), known(1), truth.writer());
  AravisSettings settings = driven();
  settings.clock_interval = std::chrono::milliseconds(100);
  AravisCamera sut(settings);
  ASSERT_TRUE(sut.start().ok());
  ASSERT_EQ(grab_frames(sut, 20).size(), 20u);
  emulator.step_clock(std::chrono::hours(-1));
  std::vector<Frame> frames;
  const bool again = wait_for([&] {
    const auto next = sut.try_grab();
    if (next.ok() && next.value()) frames.push_back(*next.value());
    return statistic(sut, "clock_jumps") == 1;
  });
  ASSERT_TRUE(again);
  for (const Frame& f : frames) {
    const double error_s = std::abs(seconds(f.stamp - *truth.middle(known_index(f))));
    EXPECT_LT(error_s, 0.2) << "meanwhile stamped by arrival, and said so: sigma " << f.stamp_sigma.count() << " ns";
  }
  EXPECT_LT(stamp_errors(grab_frames(sut, 50), truth).quantile(0.5), 0.5);
}

TEST_F(AravisCameraTest, GivesOutNoFrameThatAClockStampedWhichHasJumped) {
  // Less than a frame's period, and less than a frame may be late: neither order nor arrival tells.
  constexpr Duration kJumps[] = {std::chrono::milliseconds(-5), std::chrono::milliseconds(4)};
  constexpr Duration kSharp = std::chrono::microseconds(200);  // far less than either
  std::vector<std::size_t> sharp;
  std::vector<std::uint64_t> unsure;
  const testing_support::MachineWitness witness;
  for (const Duration jump : kJumps) {
    TruthLog truth;
    GigeCameraSettings device = emulated();
    device.rate_hz = 50;
    GigeCameraEmulator emulator(device, known(1), truth.writer());
    AravisSettings settings = driven();
    settings.info.rate_hz = 50;
    AravisCamera sut(settings);
    ASSERT_TRUE(sut.start().ok());
    ASSERT_EQ(grab_frames(sut, 20).size(), 20u);
    MonotonicClock{}.sleep_until(MonotonicClock{}.now() + std::chrono::milliseconds(8));
    emulator.step_clock(jump);  // before the next frame is exposed, and before anybody asks the clock again
    const std::vector<Frame> frames = grab_frames(sut, 60);
    ASSERT_EQ(frames.size(), 60u);
    sharp.push_back(0);
    double worst_s = 0;
    for (const Frame& f : frames) {
      const double error_s = std::abs(seconds(f.stamp - *truth.middle(known_index(f))));
      EXPECT_LT(error_s, 7 * seconds(f.stamp_sigma)) << "frame " << f.sequence;
      if (f.stamp_sigma >= kSharp) continue;
      EXPECT_LT(error_s, 1e-3) << "frame " << f.sequence;
      worst_s = std::max(worst_s, error_s);
      ++sharp.back();
    }
    const CameraCounters c = sut.counters();
    EXPECT_EQ(frames.back().sequence + 1, c.delivered + c.left_out());
    unsure.push_back(c.clock_unsure);
    std::cout << "jump of " << seconds(jump) * 1e3 << " ms: " << c.clock_unsure << " frames left out, " << sharp.back()
              << " of 60 known to 0.2 ms, wrong by " << worst_s * 1e3 << " ms at most\n";
  }
  TANKRIG_SKIP_IF_LATE(witness, testing_support::kStarved);  // a reading of the clock is as wide as it took
  for (const std::size_t frames : sharp) EXPECT_GE(frames, 50u);
  for (const std::uint64_t frames : unsure) EXPECT_GT(frames, 0u) << "the one that was exposed next was given out";
}

TEST_F(AravisCameraTest, CountsOnWhereThe16BitFrameIdWraps) {
  GigeCameraSettings device = emulated();
  device.rate_hz = 400;
  device.exposure_us = 500;
  GigeCameraEmulator emulator(device, known(1));
  AravisSettings settings = driven();
  settings.info.rate_hz = 400;
  settings.exposure_us = 500;
  settings.buffers = 32;
  AravisCamera sut(settings);
  ASSERT_TRUE(sut.start().ok());
  const std::vector<Frame> frames = grab_frames(sut, 200);  // the wrap is at 135
  ASSERT_EQ(frames.size(), 200u);
  for (const Frame& f : frames)
    ASSERT_EQ(cv::norm(f.image, known_picture(known_index(f), kSize, 1), cv::NORM_INF), 0) << "frame " << f.sequence;
  EXPECT_GT(frames.back().sequence, 140u);
  EXPECT_LT(frames.back().sequence, 65000u);
  EXPECT_EQ(statistic(sut, "frame_id_restarts"), 0);
}

TEST_F(AravisCameraTest, GivesOutTheMemoryThatPacketsWereGatheredInUntilItsLastReaderIsGone) {
  GigeCameraEmulator emulator(emulated(), known(1));
  AravisSettings settings = driven();
  settings.buffers = 3;
  AravisCamera sut(settings);
  ASSERT_TRUE(sut.start().ok());
  std::vector<Frame> kept = grab_frames(sut, 12);  // four times the buffers
  ASSERT_EQ(kept.size(), 12u);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    EXPECT_EQ(cv::norm(kept[i].image, known_picture(known_index(kept[i]), kSize, 1), cv::NORM_INF), 0);
    for (std::size_t k = 0; k < i; ++k) EXPECT_NE(kept[i].image.data, kept[k].image.data);
  }
  std::vector<const std::uint8_t*> known_memory;
  for (const Frame& f : kept) known_memory.push_back(f.image.data);
  kept.clear();
  std::size_t reused = 0;
  for (const Frame& f : grab_frames(sut, 30))
    reused += std::count(known_memory.begin(), known_memory.end(), f.image.data) > 0;
  EXPECT_EQ(reused, known_memory.size()) << "memory returns";
}

TEST_F(AravisCameraTest, PicturesOutliveTheCamera) {
  std::vector<Frame> frames;
  {
    GigeCameraEmulator emulator(emulated(), known(1));
    AravisCamera sut(driven());
    ASSERT_TRUE(sut.start().ok());
    frames = grab_frames(sut, 3);
  }
  ASSERT_EQ(frames.size(), 3u);
  for (const Frame& f : frames) EXPECT_EQ(cv::norm(f.image, known_picture(known_index(f), kSize, 1), cv::NORM_INF), 0);
}

TEST_F(AravisCameraTest, ReceivesThroughAPacketSocketToo) {
  if (!socket_limits().packet_sockets) GTEST_SKIP() << "packet sockets are forbidden here (CAP_NET_RAW)";
  TruthLog truth;
  GigeCameraEmulator emulator(emulated(), known(1), truth.writer());
  AravisSettings settings = driven();
  settings.socket = AravisSettings::Socket::kPacket;
  AravisCamera sut(settings);
  ASSERT_TRUE(sut.start().ok());
  const std::vector<Frame> frames = grab_frames(sut, 60);
  ASSERT_EQ(frames.size(), 60u);
  EXPECT_EQ(statistic(sut, "packet_socket"), 1);
  for (const Frame& f : frames)
    EXPECT_EQ(cv::norm(f.image, known_picture(known_index(f), kSize, 1), cv::NORM_INF), 0) << "frame " << f.sequence;
  EXPECT_LT(stamp_errors(frames, truth).quantile(0.5), 0.5) << "its longer way does not move the stamp";
}

TEST_F(AravisCameraTest, StopsAndStartsAgainAndCountsNothingLostMeanwhile) {
  GigeCameraEmulator emulator(emulated(), known(1));
  AravisCamera sut(driven());
  EXPECT_EQ(sut.try_grab().error().code, ErrorCode::kNotReady);
  ASSERT_TRUE(sut.start().ok());
  const std::vector<Frame> before = grab_frames(sut, 3);
  ASSERT_EQ(before.size(), 3u);
  sut.stop();
  EXPECT_EQ(sut.try_grab().error().code, ErrorCode::kNotReady);
  const CameraCounters counted = sut.counters();
  MonotonicClock{}.sleep_until(MonotonicClock{}.now() + std::chrono::milliseconds(150));  // 22 periods
  ASSERT_TRUE(sut.start().ok());
  const std::vector<Frame> frames = grab_frames(sut, 5);
  ASSERT_EQ(frames.size(), 5u);
  EXPECT_GT(frames.front().sequence, before.back().sequence);
  EXPECT_LT(frames.front().sequence, before.back().sequence + 4);
  const CameraCounters c = sut.counters();
  EXPECT_EQ(frames.back().sequence - before.back().sequence,
            c.delivered + c.left_out() - counted.delivered - counted.left_out());
}

TEST_F(AravisCameraTest, TakesThreeCamerasAtOnceByAddressOrSerialNumber) {
  std::vector<std::unique_ptr<GigeCameraEmulator>> emulators;
  for (int i = 1; i <= 3; ++i) {
    GigeCameraSettings device = emulated();
    device.address = "127.0.0." + std::to_string(i);
    device.serial = "TANK-" + std::to_string(i);
    device.rate_hz = 50;
    emulators.push_back(std::make_unique<GigeCameraEmulator>(
        device, [i](std::uint64_t index, Stamp, Duration) { return known_picture(index + 100u * i, kSize, 1); }));
  }
  std::vector<std::unique_ptr<AravisCamera>> cameras;
  for (int i = 1; i <= 3; ++i) {
    AravisSettings settings = driven();
    settings.address = i < 3 ? "127.0.0." + std::to_string(i) : "";
    settings.serial = "TANK-" + std::to_string(i);
    settings.info.rate_hz = 50;
    cameras.push_back(std::make_unique<AravisCamera>(settings));
  }
  for (auto& c : cameras) ASSERT_TRUE(c->start().ok());
  for (int i = 1; i <= 3; ++i)
    for (const Frame& f : grab_frames(*cameras[static_cast<std::size_t>(i - 1)], 6))
      EXPECT_EQ(cv::norm(f.image, known_picture(known_index(f, 100u * i) + 100u * i, kSize, 1), cv::NORM_INF), 0)
          << "camera " << i;
}

}  // namespace
}  // namespace tankrig::testing
