// Triggers of the Aravis driver: software triggers answered, line triggers and resends seen in registers and commands.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <set>

#include "core/trigger_pairing.hpp"
#include "tests/camera/gige_rig.hpp"

namespace tankrig::testing {
namespace {

using sim::GigeCameraEmulator;
using sim::GigeCameraSettings;

const cv::Size kTriggeredSize(160, 120);

GigeCameraSettings triggered_camera(const std::string& address = "127.0.0.1") {
  GigeCameraSettings s;
  s.address = address;
  s.width = kTriggeredSize.width;
  s.height = kTriggeredSize.height;
  s.rate_hz = 50;
  s.exposure_us = 3000;
  return s;
}

AravisSettings trigger_settings(const std::string& trigger, const std::string& address = "127.0.0.1") {
  AravisSettings s;
  s.info = {"left", kTriggeredSize.width, kTriggeredSize.height, 1, 50};
  s.address = address;
  s.exposure_us = 3000;
  s.packet_size = 9000;
  s.trigger = trigger;
  s.clock_interval = std::chrono::milliseconds(100);
  return s;
}

cv::Mat triggered_picture(std::uint64_t index, Stamp, Duration) { return known_picture(index, kTriggeredSize, 1); }

class AravisTriggerTest : public GigeTest {};

TEST_F(AravisTriggerTest, ExposesOneFramePerSoftwareTriggerAfterIt) {
  TruthLog truth;
  GigeCameraEmulator emulator(triggered_camera(), triggered_picture, truth.writer());
  AravisCamera sut(trigger_settings("software"));
  ASSERT_TRUE(sut.start().ok());
  for (int i = 0; i < 10; ++i) {
    const Stamp before = MonotonicClock{}.now();
    ASSERT_TRUE(sut.trigger().ok());
    const Result<std::optional<Frame>> frame = grab(sut);
    ASSERT_TRUE(frame.ok() && frame.value());
    EXPECT_EQ(frame.value()->sequence, static_cast<std::uint64_t>(i));
    EXPECT_EQ(
        cv::norm(frame.value()->image, known_picture(static_cast<std::uint64_t>(i), kTriggeredSize, 1), cv::NORM_INF),
        0);
    EXPECT_GT(frame.value()->stamp, before) << "exposed after its trigger";
    EXPECT_NEAR(seconds(frame.value()->stamp - *truth.middle(known_index(*frame.value()))), 0, 2e-3);
  }
  EXPECT_EQ(emulator.exposures(), 10u) << "no frame without a trigger";
  EXPECT_EQ(statistic(sut, "stalls"), 0) << "a camera that waits for its trigger does not stall";
}

TEST_F(AravisTriggerTest, RefusesASoftwareTriggerOnAFreeRunningCamera) {
  GigeCameraEmulator emulator(triggered_camera(), triggered_picture);
  AravisCamera sut(trigger_settings("off"));
  const Status refused = sut.trigger();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  EXPECT_STREQ(refused.error().where, "camera: not set to software trigger");
}

TEST_F(AravisTriggerTest, RefusesATriggerUnlessItHasStarted) {
  GigeCameraEmulator emulator(triggered_camera(), triggered_picture);
  AravisCamera sut(trigger_settings("software"));
  const auto refused = [&] {
    const Status status = sut.trigger();
    return !status.ok() && status.error().code == ErrorCode::kNotReady;
  };
  EXPECT_TRUE(refused()) << "before";
  ASSERT_TRUE(sut.start().ok());
  EXPECT_TRUE(sut.trigger().ok());
  sut.stop();
  EXPECT_TRUE(refused()) << "after";
}

TEST_F(AravisTriggerTest, ArmsALineWithItsRisingEdge) {
  // The emulator has no lines: what the driver wrote is seen in its registers (addresses: Aravis' fake camera).
  constexpr std::uint32_t kTriggerMode = 0x300, kTriggerSource = 0x304, kTriggerActivation = 0x308,
                          kAcquisition = 0x124;
  GigeCameraEmulator emulator(triggered_camera(), triggered_picture);
  {
    AravisCamera software(trigger_settings("software"));
    EXPECT_EQ(emulator.read_register(kTriggerMode), 1u);
    EXPECT_EQ(emulator.read_register(kTriggerSource), 1u) << "Software";
  }
  {
    AravisCamera sut(trigger_settings("Line0"));
    EXPECT_EQ(emulator.read_register(kTriggerMode), 1u);
    EXPECT_EQ(emulator.read_register(kTriggerSource), 0u) << "Line0";
    EXPECT_EQ(emulator.read_register(kTriggerActivation), 0u) << "RisingEdge";
    EXPECT_EQ(emulator.read_register(kAcquisition), 0u);
    ASSERT_TRUE(sut.start().ok());
    EXPECT_EQ(emulator.read_register(kAcquisition), 1u);
    sut.stop();
    EXPECT_EQ(emulator.read_register(kAcquisition), 0u);
  }
  AravisCamera free_running(trigger_settings("off"));
  EXPECT_EQ(emulator.read_register(kTriggerMode), 0u) << "no trigger is left armed";
}

/// GigE Vision commands on their way to a camera, as they pass the loopback.
class CommandTap {
 public:
  CommandTap() : fd_(::socket(AF_INET, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, IPPROTO_UDP)) {}
  ~CommandTap() {
    if (fd_ >= 0) ::close(fd_);
  }
  bool permitted() const { return fd_ >= 0; }

  struct Resend {
    int block = 0;
    std::uint32_t first = 0, last = 0;
  };

  /// PACKETRESEND_CMD since the last call (AIA GigE Vision 2.0, 16.4.6.1).
  std::vector<Resend> resends() {
    constexpr std::size_t kIp = 20, kUdp = 8;
    std::vector<Resend> found;
    std::array<std::uint8_t, 65536> packet;
    for (ssize_t n; (n = ::recv(fd_, packet.data(), packet.size(), 0)) > 0;) {
      if (n < static_cast<ssize_t>(kIp + kUdp + 20)) continue;
      const std::uint8_t* udp = packet.data() + kIp;
      const std::uint8_t* command = udp + kUdp;
      if ((udp[2] << 8 | udp[3]) != 3956 || command[0] != 0x42 || (command[2] << 8 | command[3]) != 0x0040) continue;
      const auto word = [&](int at) {
        return static_cast<std::uint32_t>(command[at] << 24 | command[at + 1] << 16 | command[at + 2] << 8 |
                                          command[at + 3]);
      };
      found.push_back({command[10] << 8 | command[11], word(12) & 0xFFFFFF, word(16) & 0xFFFFFF});
    }
    return found;
  }

 private:
  int fd_;
};

TEST_F(AravisTriggerTest, AsksForMissingPacketsOnceMoreOfACameraThatCanResend) {
  CommandTap tap;
  if (!tap.permitted()) GTEST_SKIP() << "raw sockets are forbidden here (CAP_NET_RAW)";
  GigeCameraSettings device = triggered_camera();
  device.width = 640;
  device.height = 480;
  device.claims_resend = true;
  GigeCameraEmulator emulator(device, [](std::uint64_t, Stamp, Duration) { return cv::Mat(480, 640, CV_8UC1, 7.0); });
  AravisSettings settings = trigger_settings("off");
  settings.info.width = 640;
  settings.info.height = 480;
  settings.packet_size = 1500;
  for (const bool resend : {true, false}) {
    SCOPED_TRACE(resend);
    settings.packet_resend = resend;
    AravisCamera sut(settings);
    ASSERT_TRUE(sut.start().ok());
    ASSERT_EQ(grab_frames(sut, 3).size(), 3u);
    tap.resends();
    emulator.lose_packets(0.01);
    std::vector<CommandTap::Resend> asked;
    ASSERT_TRUE(wait_for([&] {
      sut.try_grab().ok();
      for (const CommandTap::Resend& r : tap.resends()) asked.push_back(r);
      return sut.counters().incomplete >= 5;
    }));
    emulator.lose_packets(0);
    EXPECT_EQ(asked.empty(), !resend);
    for (const CommandTap::Resend& r : asked) {
      EXPECT_GE(r.block, 1);
      EXPECT_LE(r.first, r.last);
      EXPECT_LE(r.last, 640u * 480 / 1400 + 2);
    }
    EXPECT_EQ(statistic(sut, "packets_resent"), 0) << "the emulator never answers them";
  }
}

TEST_F(AravisTriggerTest, ExposesForEveryTriggerOfAStreamFromItsFirstOn) {
  TruthLog truth;
  GigeCameraEmulator emulator(triggered_camera(), triggered_picture, truth.writer());
  AravisCamera sut(trigger_settings("software"));
  std::uint64_t triggers = 0;
  for (int stream = 0; stream < 3; ++stream) {
    ASSERT_TRUE(sut.start().ok());
    std::vector<Stamp> given;
    for (int i = 0; i < 5; ++i, ++triggers) {  // none waits for the frame of the one before
      given.push_back(MonotonicClock{}.now());
      ASSERT_TRUE(sut.trigger().ok());
      MonotonicClock{}.sleep_until(MonotonicClock{}.now() + std::chrono::milliseconds(5));  // the exposure takes 3
    }
    const std::vector<Frame> frames = grab_frames(sut, given.size());
    ASSERT_EQ(frames.size(), given.size());
    for (std::size_t i = 0; i < given.size(); ++i) {
      const Stamp exposed = *truth.middle(triggers - given.size() + i);
      EXPECT_GT(exposed, given[i]);
      if (i + 1 < given.size()) {
        EXPECT_LT(exposed, given[i + 1]) << "before the next";
      }
      EXPECT_NEAR(seconds(frames[i].stamp - exposed), 0, 2e-3);
    }
    sut.stop();
  }
  EXPECT_EQ(emulator.exposures(), triggers);
  EXPECT_EQ(emulator.triggers_ignored(), 0u);
  EXPECT_EQ(sut.counters().delivered, triggers);
}

TEST_F(AravisTriggerTest, IgnoresATriggerWhileItExposesAsCamerasDo) {
  GigeCameraSettings device = triggered_camera();
  device.exposure_us = 500'000;
  AravisSettings settings = trigger_settings("software");
  settings.exposure_us = device.exposure_us;
  GigeCameraEmulator emulator(device, triggered_picture);
  AravisCamera sut(settings);
  ASSERT_TRUE(sut.start().ok());
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(sut.trigger().ok());
  EXPECT_EQ(grab_frames(sut, 1).size(), 1u);
  EXPECT_EQ(emulator.triggers_ignored(), 2u);
  EXPECT_EQ(emulator.exposures(), 1u);
}

TEST_F(AravisTriggerTest, CountsWhatCameAfterItsReaderHadStopped) {
  GigeCameraEmulator emulator(triggered_camera(), triggered_picture);
  AravisSettings settings = trigger_settings("software");
  settings.packet_size = 576;
  AravisCamera sut(settings);
  emulator.lose_packets(0.2);  // of some 40: no frame is whole, none is lost without a trace
  std::uint64_t triggers = 0;
  for (int run = 0; run < 2; ++run) {
    ASSERT_TRUE(sut.start().ok());
    ASSERT_TRUE(sut.trigger().ok());
    ++triggers;
    ASSERT_TRUE(wait_for([&] { return emulator.sent() == triggers; }));
    sut.stop();  // before anybody knows that packets are missing
    EXPECT_TRUE(wait_for([&] { return sut.counters().incomplete == triggers; })) << sut.counters().incomplete;
  }
  emulator.lose_packets(0);
  ASSERT_TRUE(sut.start().ok());
  ASSERT_TRUE(sut.trigger().ok());
  ++triggers;
  ASSERT_TRUE(wait_for([&] { return emulator.sent() == triggers; }));
  sut.stop();
  EXPECT_TRUE(wait_for([&] { return sut.counters().unread == 1; })) << "whole, and nobody took it";
  EXPECT_EQ(sut.counters().delivered, 0u);
  EXPECT_EQ(sut.counters().left_out(), triggers);
}

TEST_F(AravisTriggerTest, PairsTwoCamerasByTheirTriggers) {
  TruthLog left_truth, right_truth;
  GigeCameraEmulator left_device(triggered_camera(), triggered_picture, left_truth.writer());
  GigeCameraEmulator right_device(triggered_camera("127.0.0.2"), triggered_picture, right_truth.writer());
  AravisCamera left(trigger_settings("software")), right(trigger_settings("software", "127.0.0.2"));
  ASSERT_TRUE(left.start().ok());
  ASSERT_TRUE(right.start().ok());
  constexpr Duration kTolerance = std::chrono::milliseconds(20);
  TriggerPairing<Frame> pairing(kTolerance);
  std::vector<FramePair<Frame>> pairs;
  MonotonicClock clock;
  std::uint64_t triggers = 0;
  for (int round = 0; round < 6; ++triggers) {
    ASSERT_LT(triggers, 500u) << "this machine never triggers two cameras within " << kTolerance.count() / 2;
    clock.sleep_until(clock.now() + 3 * kTolerance);  // no frame is near one of another round
    left_device.lose_packets(round == 3 ? 1 : 0);
    ASSERT_TRUE(left.trigger().ok());
    ASSERT_TRUE(right.trigger().ok());
    std::vector<Frame> lefts;
    if (round == 3)
      ASSERT_TRUE(wait_for([&] { return left_device.sent() == triggers + 1; }))
          << left_device.sent() << " sent of " << triggers + 1 << ", ignored " << left_device.triggers_ignored();
    else
      lefts = grab_frames(left, 1);
    std::vector<Frame> rights = grab_frames(right, 1);
    const Duration apart = *left_truth.middle(triggers) - *right_truth.middle(triggers);
    if (std::chrono::abs(apart) > kTolerance / 2 && round != 3) continue;  // two commands on a busy machine
    for (Frame& f : lefts) pairing.add_left(std::move(f));
    for (Frame& f : rights) pairing.add_right(std::move(f));
    while (auto pair = pairing.next()) pairs.push_back(std::move(*pair));
    ++round;
  }
  ASSERT_EQ(pairs.size(), 5u);
  for (const FramePair<Frame>& p : pairs) EXPECT_EQ(p.left.sequence, p.right.sequence);
  EXPECT_EQ(left.counters().lost, 1u);
}

}  // namespace
}  // namespace tankrig::testing
