// What the Aravis driver says and counts when the wire or the camera fails.
#include <gtest/gtest.h>

#include <atomic>
#include <iostream>
#include <memory>

#include "core/input_error.hpp"
#include "drivers/camera/aravis_socket.hpp"
#include "tests/camera/gige_rig.hpp"
#include "tests/support/sanitizers.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::testing {
namespace {

using sim::GigeCameraEmulator;
using sim::GigeCameraSettings;

const cv::Size kFaultSize(320, 240);

GigeCameraSettings faulty_camera() {
  GigeCameraSettings s;
  s.width = kFaultSize.width;
  s.height = kFaultSize.height;
  s.rate_hz = 100;
  s.exposure_us = 2000;
  return s;
}

AravisSettings fault_settings() {
  AravisSettings s;
  s.info = {"left", kFaultSize.width, kFaultSize.height, 1, 100};
  s.address = "127.0.0.1";
  s.exposure_us = 2000;
  s.packet_size = 4000;
  s.packet_resend = false;
  s.discovery_timeout = std::chrono::milliseconds(400);
  s.clock_interval = std::chrono::milliseconds(100);
  return s;
}

cv::Mat fault_picture(std::uint64_t index, Stamp, Duration) { return known_picture(index, kFaultSize, 1); }

/// Between a frame and the counts others may be left out: once the reader has caught up, none is.
void expect_every_number_has_its_fate(Camera& camera) {
  EXPECT_TRUE(wait_for([&] {
    const auto next = camera.try_grab();
    if (!next.ok() || !next.value()) return false;
    const CameraCounters c = camera.counters();
    const std::uint64_t numbers = next.value()->sequence + 1;
    EXPECT_LE(numbers, c.delivered + c.left_out());
    return numbers == c.delivered + c.left_out();
  }));
}

std::string opening_error(const AravisSettings& settings) {
  return message_of<InputError>([&] { AravisCamera camera(settings); });
}

class AravisFaultTest : public GigeTest {};

TEST_F(AravisFaultTest, CountsFramesWithMissingPacketsAndGivesOutOnlyWholeOnes) {
  GigeCameraEmulator emulator(faulty_camera(), fault_picture);
  AravisCamera sut(fault_settings());
  ASSERT_TRUE(sut.start().ok());
  ASSERT_EQ(grab_frames(sut, 3).size(), 3u);
  emulator.lose_packets(0.02);
  std::vector<Frame> frames;
  ASSERT_TRUE(wait_for([&] {
    const auto next = sut.try_grab();
    if (next.ok() && next.value()) frames.push_back(*next.value());
    return sut.counters().incomplete >= 5 && frames.size() >= 20;
  }));
  emulator.lose_packets(0);
  for (const Frame& f : frames)
    EXPECT_EQ(cv::norm(f.image, known_picture(known_index(f), kFaultSize, 1), cv::NORM_INF), 0)
        << "frame " << f.sequence;
  EXPECT_GT(statistic(sut, "packets_missing"), 0);
  EXPECT_EQ(statistic(sut, "packets_resent"), 0) << "this camera cannot resend";
  expect_every_number_has_its_fate(sut);
}

TEST_F(AravisFaultTest, SaysOnceThatACameraStallsAndCountsWhatItNeverSaw) {
  GigeCameraEmulator emulator(faulty_camera(), fault_picture);
  AravisCamera sut(fault_settings());
  ASSERT_TRUE(sut.start().ok());
  ASSERT_EQ(grab_frames(sut, 3).size(), 3u);
  emulator.stall(true);
  Result<std::optional<Frame>> failed = std::optional<Frame>{};
  ASSERT_TRUE(wait_for([&] { return !(failed = sut.try_grab()).ok(); }));
  EXPECT_EQ(failed.error().code, ErrorCode::kTimeout);
  EXPECT_STREQ(failed.error().where, "camera: no frames");
  for (int i = 0; i < 50; ++i) EXPECT_TRUE(sut.try_grab().ok()) << "said once";
  EXPECT_EQ(statistic(sut, "stalls"), 1);
  const std::uint64_t lost = sut.counters().lost;
  emulator.stall(false);
  const std::vector<Frame> after = grab_frames(sut, 3);
  ASSERT_EQ(after.size(), 3u);
  EXPECT_GT(sut.counters().lost + sut.counters().incomplete, lost + 20) << "half a second at 100 frames/s";
  EXPECT_EQ(statistic(sut, "disconnects"), 0) << "it answered all the time";
}

TEST_F(AravisFaultTest, StopsACameraThatHasStalledWithoutKeepingItsReaderWaiting) {
  GigeCameraEmulator emulator(faulty_camera(), fault_picture);
  AravisCamera sut(fault_settings());
  const auto stall_and_stop = [&] {
    ASSERT_TRUE(wait_for([&] { return !sut.try_grab().ok(); }));
    const Stamp begin = MonotonicClock{}.now();
    sut.stop();
    EXPECT_LT(MonotonicClock{}.now() - begin, std::chrono::milliseconds(100) * testing_support::kSlowness);
  };
  ASSERT_TRUE(sut.start().ok());
  ASSERT_EQ(grab_frames(sut, 3).size(), 3u);
  emulator.stall(true);  // it answers: its own thread stops it
  stall_and_stop();
  ASSERT_TRUE(wait_for([&] { return emulator.read_register(0x124) == 0; })) << "AcquisitionStop";
  emulator.stall(false);
  ASSERT_TRUE(sut.start().ok());
  ASSERT_EQ(grab_frames(sut, 3).size(), 3u);
  emulator.unplug();
  stall_and_stop();
  emulator.plug();  // else its connection's end takes Aravis' control time-outs
}

TEST_F(AravisFaultTest, CountsPicturesThatAreShorterThanPromised) {
  GigeCameraEmulator emulator(faulty_camera(), fault_picture);
  AravisCamera sut(fault_settings());
  ASSERT_TRUE(sut.start().ok());
  ASSERT_EQ(grab_frames(sut, 3).size(), 3u);
  emulator.send_short_pictures(true);
  ASSERT_TRUE(wait_for([&] {
    const auto next = sut.try_grab();
    if (next.ok() && next.value()) {
      EXPECT_EQ(next.value()->image.size(), kFaultSize);
    }
    return statistic(sut, "short_frames") >= 3;
  }));
  EXPECT_GE(sut.counters().incomplete, 3u);
  emulator.send_short_pictures(false);
  EXPECT_EQ(grab_frames(sut, 3).size(), 3u);
}

TEST_F(AravisFaultTest, IsDisconnectedWhileTheCameraIsUnpluggedAndGoesOnWhenItIsBack) {
  GigeCameraEmulator emulator(faulty_camera(), fault_picture);
  AravisCamera sut(fault_settings());
  ASSERT_TRUE(sut.start().ok());
  const std::vector<Frame> before = grab_frames(sut, 5);
  ASSERT_EQ(before.size(), 5u);
  emulator.unplug();
  Result<std::optional<Frame>> failed = std::optional<Frame>{};
  Duration longest{};
  ASSERT_TRUE(wait_for(
      [&] {
        const Stamp begin = MonotonicClock{}.now();
        failed = sut.try_grab();
        longest = std::max(longest, MonotonicClock{}.now() - begin);
        return !failed.ok() && failed.error().code == ErrorCode::kDisconnected;
      },
      std::chrono::seconds(20)));
  EXPECT_STREQ(failed.error().where, "camera: vanished, searched for");
  EXPECT_EQ(sut.try_grab().error().code, ErrorCode::kDisconnected) << "as long as it is away";
  emulator.plug();
  std::optional<Frame> back;
  ASSERT_TRUE(wait_for(
      [&] {
        const Stamp begin = MonotonicClock{}.now();
        const auto next = sut.try_grab();
        longest = std::max(longest, MonotonicClock{}.now() - begin);
        if (next.ok()) back = next.value();
        return back.has_value();
      },
      std::chrono::seconds(20)));
  EXPECT_GT(back->sequence, before.back().sequence) << "the sequence goes on";
  EXPECT_EQ(statistic(sut, "disconnects"), 1);
  EXPECT_EQ(statistic(sut, "reconnects"), 1);
  EXPECT_LT(longest, std::chrono::milliseconds(450) * testing_support::kSlowness)
      << "time-outs are off the caller's path";
}

TEST_F(AravisFaultTest, NoticesACameraThatWasSwitchedOffAndOnWithinItsHeartbeat) {
  GigeCameraEmulator emulator(faulty_camera(), fault_picture);
  AravisCamera sut(fault_settings());
  ASSERT_TRUE(sut.start().ok());
  ASSERT_EQ(grab_frames(sut, 3).size(), 3u);
  emulator.unplug();
  emulator.plug();
  ASSERT_TRUE(wait_for(
      [&] {
        const auto next = sut.try_grab();
        return next.ok() && next.value() && statistic(sut, "reconnects") >= 1;
      },
      std::chrono::seconds(20)));
}

TEST_F(AravisFaultTest, CountsAsOverrunWhatItsReaderLeftLying) {
  GigeCameraEmulator emulator(faulty_camera(), fault_picture);
  AravisSettings settings = fault_settings();
  settings.buffers = 4;
  AravisCamera sut(settings);
  ASSERT_TRUE(sut.start().ok());
  ASSERT_EQ(grab_frames(sut, 2).size(), 2u);
  const std::uint64_t begin = emulator.exposures();
  ASSERT_TRUE(wait_for([&] { return emulator.exposures() > begin + 40; }));
  const std::vector<Frame> frames = grab_frames(sut, 12);
  ASSERT_EQ(frames.size(), 12u);
  EXPECT_GT(sut.counters().overrun, 20u);
  expect_every_number_has_its_fate(sut);
  for (const Frame& f : frames)
    EXPECT_EQ(cv::norm(f.image, known_picture(known_index(f), kFaultSize, 1), cv::NORM_INF), 0);
}

TEST_F(AravisFaultTest, SaysWhatItFoundInsteadOfASerialNumber) {
  GigeCameraEmulator emulator(faulty_camera(), fault_picture);
  AravisSettings settings = fault_settings();
  settings.address.clear();
  settings.serial = "23456789";
  EXPECT_EQ(
      opening_error(settings),
      "camera left: no camera with serial 23456789 (found Aravis Fake serial EMULATED-1 at 127.0.0.1): check power, "
      "cable and that its address is in this machine's subnet");
}

TEST_F(AravisFaultTest, SaysThatNothingAnswersAtAnAddress) {
  AravisSettings settings = fault_settings();
  EXPECT_EQ(
      opening_error(settings),
      "camera left: no GigE Vision camera answers at 127.0.0.1 (no camera answered): check power, cable and address");
}

TEST_F(AravisFaultTest, RefusesTheWrongCameraAtTheRightAddress) {
  GigeCameraEmulator emulator(faulty_camera(), fault_picture);
  AravisSettings settings = fault_settings();
  settings.serial = "OTHER";
  EXPECT_EQ(opening_error(settings), "camera left: the camera at 127.0.0.1 has serial EMULATED-1, expected OTHER");
}

TEST_F(AravisFaultTest, RefusesACameraThatAnotherProgramControls) {
  GigeCameraEmulator emulator(faulty_camera(), fault_picture);
  AravisCamera first(fault_settings());
  EXPECT_EQ(
      opening_error(fault_settings()),
      "camera left: the camera at 127.0.0.1 is controlled by another program (Controller privilege required): close "
      "that program");
  ASSERT_TRUE(first.start().ok());
  EXPECT_EQ(grab_frames(first, 3).size(), 3u) << "the first goes on";
}

TEST_F(AravisFaultTest, NamesTheFeatureThatACameraRefuses) {
  GigeCameraEmulator emulator(faulty_camera(), fault_picture);
  AravisSettings settings = fault_settings();
  settings.pixel_format = "BGR8";
  EXPECT_NE(opening_error(settings).find("camera left: cannot set PixelFormat to BGR8: "), std::string::npos);
  EXPECT_NE(opening_error(settings).find("it offers BayerBG8 BayerGB8 BayerGR8 BayerRG8 Mono8 RGB8 Mono16"),
            std::string::npos);
  settings = fault_settings();
  settings.info.width = 4000;
  EXPECT_EQ(opening_error(settings),
            "camera left: a picture of 4000 x 240 at offset 0, 0 does not fit its sensor of 320 x 240");
  settings = fault_settings();
  settings.trigger = "Line7";
  EXPECT_NE(opening_error(settings).find("camera left: cannot set TriggerSource to Line7: "), std::string::npos);
  settings = fault_settings();
  settings.gain_db = 3;
  EXPECT_NE(opening_error(settings).find("camera left: cannot set Gain to 3.000000 dB: "), std::string::npos);
  settings = fault_settings();
  settings.chunk_stamps = true;
  EXPECT_NE(opening_error(settings).find("camera left: cannot set ChunkSelector to Timestamp: "), std::string::npos);
}

TEST(AravisSocketPlan, TakesAnOrdinarySocketWhereTwoFramesFitItsBuffer) {
  using Socket = AravisSettings::Socket;
  const SocketPlan plan = plan_socket("left", Socket::kAuto, 1'310'720, {4 << 20, true});
  EXPECT_FALSE(plan.packet);
  EXPECT_EQ(plan.buffer_bytes, 4 << 20) << "all that it may have, up to eight frames";
  EXPECT_EQ(plan_socket("left", Socket::kAuto, 1'310'720, {64 << 20, true}).buffer_bytes, 8 * 1'310'720);
  EXPECT_EQ(plan_socket("left", Socket::kAuto, 1000, {4 << 20, false}).buffer_bytes, 1 << 20)
      << "bursts of small frames";
}

TEST(AravisSocketPlan, TakesAPacketSocketWhereTheBufferIsTooSmallAndItIsPermitted) {
  EXPECT_TRUE(plan_socket("left", AravisSettings::Socket::kAuto, 6'220'800, {4 << 20, true}).packet);
  EXPECT_TRUE(plan_socket("left", AravisSettings::Socket::kPacket, 1000, {4 << 20, true}).packet);
}

TEST(AravisSocketPlan, SaysHowToEnlargeTheBuffer) {
  using Socket = AravisSettings::Socket;
  const auto error = [](Socket socket, const SocketLimits& limits) {
    return message_of<InputError>([&] { plan_socket("left", socket, 1'310'720, limits); });
  };
  EXPECT_EQ(error(Socket::kAuto, {212'992, false}),
            "camera left: two frames need a socket buffer of 2621440 bytes, the system allows 212992: sysctl -w "
            "net.core.rmem_max=2621440, or run with CAP_NET_RAW");
  EXPECT_EQ(error(Socket::kDatagram, {212'992, true}),
            "camera left: two frames need a socket buffer of 2621440 bytes, the system allows 212992: sysctl -w "
            "net.core.rmem_max=2621440, or use socket packet");
  EXPECT_EQ(error(Socket::kPacket, {4 << 20, false}),
            "camera left: socket packet needs CAP_NET_RAW: run as root, or use socket datagram");
}

TEST(AravisSocketPlan, AsksTheSystemForItsLimits) { EXPECT_GT(socket_limits().buffer_bytes, 4096u); }

}  // namespace
}  // namespace tankrig::testing
