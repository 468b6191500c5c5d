// The V4L2 driver and the emulated V4L2 camera on the kernel's own test drivers: vivid at /dev/video0, v4l2loopback at
// /dev/video10. They are in the kernel tests' virtual machine; elsewhere these tests skip.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <mutex>

#include "core/clock.hpp"
#include "core/input_error.hpp"
#include "drivers/camera/v4l2_camera.hpp"
#include "drivers/camera/v4l2_controls.hpp"
#include "sim_backends/wire/v4l2_output.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

std::vector<Frame> grab(V4l2Camera& camera, std::size_t count) {
  std::vector<Frame> frames;
  const MonotonicClock clock;
  const Stamp deadline = clock.now() + 60s;
  while (frames.size() < count && clock.now() < deadline) {
    auto news = camera.try_grab();
    if (!news.ok()) {
      ADD_FAILURE() << news.error().where << ", errno " << news.error().os_errno;
      return frames;
    }
    if (news.value())
      frames.push_back(std::move(*news.value()));
    else
      camera.wait(100ms);
  }
  EXPECT_EQ(frames.size(), count);
  return frames;
}

double statistic(const V4l2Camera& camera, const std::string& name) {
  for (const Statistic& one : camera.statistics())
    if (one.name == name) return one.value;
  return -1;
}

void set_vivid(const std::string& control, std::int32_t value) {
  const auto device = kernel_v4l2_device();
  ASSERT_EQ(device->open("/dev/video0"), 0);
  V4l2Controls(*device).set(control, value);
}

enum VividPattern { kWhite = 6, kRed = 7, kGreen = 8, kBlue = 9, kAlternatingRows = 15 };

class V4l2Guest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists("/sys/module/vivid") || !std::filesystem::exists("/dev/video0"))
      GTEST_SKIP() << "no vivid at /dev/video0: run in the kernel tests' virtual machine";
    set_vivid("osd_text_mode", 2);  // no text over the pattern
  }
  void TearDown() override {
    if (IsSkipped()) return;
    set_vivid("osd_text_mode", 0);
    set_vivid("test_pattern", 0);
    set_vivid("percentage_of_dropped_buffers", 0);
    set_vivid("timestamp_source", 0);
  }

  static V4l2CameraSettings vivid(PixelFormat format, int channels) {
    V4l2CameraSettings settings;
    settings.name = "vivid";
    settings.width = 320;
    settings.height = 180;
    settings.rate_hz = 30;
    settings.formats = {format};
    settings.channels = channels;
    settings.exposure = 10ms;
    settings.timeout = 10s;
    return settings;
  }
};

TEST_F(V4l2Guest, StreamsGreyOnTheMonotonicClockAtItsRate) {
  V4l2Camera camera(vivid(PixelFormat::kGrey, 1));
  ASSERT_TRUE(camera.start().ok());
  const Stamp begin = MonotonicClock().now();
  const auto frames = grab(camera, 60);
  const Stamp end = MonotonicClock().now();
  ASSERT_EQ(frames.size(), 60u);
  for (std::size_t i = 1; i < frames.size(); ++i) EXPECT_GT(frames[i].stamp, frames[i - 1].stamp) << "frame " << i;
  // vivid paces by the scheduler's ticks: single periods jitter, their mean does not.
  const double frames_long = static_cast<double>(frames.back().sequence - frames.front().sequence);
  EXPECT_NEAR(seconds(frames.back().stamp - frames.front().stamp) * camera.info().rate_hz / frames_long, 1, 0.2);
  EXPECT_GT(frames.front().stamp, begin - 50ms);
  EXPECT_LT(frames.back().stamp, end + 50ms);
  EXPECT_EQ(statistic(camera, "stamps_monotonic"), 60);
  EXPECT_EQ(statistic(camera, "stamp_at_start"), 0);
  EXPECT_EQ(camera.counters().delivered, 60u);
  EXPECT_EQ(frames.back().sequence - frames.front().sequence + 1,
            60 + camera.counters().lost + camera.counters().overrun);
  EXPECT_THAT(camera.description(), HasSubstr("vivid at /dev/video0: GREY 320x180, field order none"));
}

TEST_F(V4l2Guest, StampsOfTheStartOfTheExposureAreKnownAsSuch) {
  set_vivid("timestamp_source", 1);
  V4l2Camera camera(vivid(PixelFormat::kGrey, 1));
  ASSERT_TRUE(camera.start().ok());
  grab(camera, 3);
  EXPECT_EQ(statistic(camera, "stamp_at_start"), 1);
  EXPECT_EQ(statistic(camera, "stamps_monotonic"), 3);
}

struct Colour {
  VividPattern pattern;
  cv::Vec3b bgr;
  double grey;
};

TEST_F(V4l2Guest, EveryFormatShowsVividsPureColours) {
  const Colour colours[] = {
      {kWhite, {255, 255, 255}, 255}, {kRed, {0, 0, 255}, 76}, {kGreen, {0, 255, 0}, 150}, {kBlue, {255, 0, 0}, 29}};
  for (const PixelFormat format :
       {PixelFormat::kYuyv, PixelFormat::kUyvy, PixelFormat::kBgr24, PixelFormat::kRgb24, PixelFormat::kBayerRggb8,
        PixelFormat::kBayerGrbg8, PixelFormat::kBayerGbrg8, PixelFormat::kBayerBggr8}) {
    for (const Colour& colour : colours) {
      SCOPED_TRACE(std::string(to_string(format)) + ", pattern " + std::to_string(colour.pattern));
      set_vivid("test_pattern", colour.pattern);
      V4l2Camera camera(vivid(format, 3));
      ASSERT_TRUE(camera.start().ok());
      const auto frames = grab(camera, 1);
      ASSERT_EQ(frames.size(), 1u);
      for (const cv::Point at : {cv::Point(0, 0), cv::Point(101, 77), cv::Point(319, 179)})
        for (int c = 0; c < 3; ++c)
          EXPECT_NEAR(frames[0].image.at<cv::Vec3b>(at)[c], colour.bgr[c], 3) << at << " channel " << c;
    }
  }
}

TEST_F(V4l2Guest, GreyAndSixteenBitsShowTheLumaOfAGreyPattern) {
  set_vivid("test_pattern", kWhite);
  for (const PixelFormat format : {PixelFormat::kGrey, PixelFormat::kGrey16, PixelFormat::kYuyv}) {
    V4l2Camera camera(vivid(format, 1));
    ASSERT_TRUE(camera.start().ok());
    const auto frames = grab(camera, 1);
    ASSERT_EQ(frames.size(), 1u);
    // GREY is full range in vivid, YUYV of sRGB limited: its white is 235, and luma stays as coded.
    EXPECT_NEAR(frames[0].image.at<std::uint8_t>(90, 160), format == PixelFormat::kYuyv ? 235 : 255, 1)
        << to_string(format);
  }
}

TEST_F(V4l2Guest, ControlsAreSetByNameAndReadBackAndTheAutomaticGainIsOff) {
  V4l2CameraSettings settings = vivid(PixelFormat::kGrey, 1);
  settings.controls = {{"brightness", 99}, {"gain", 17}, {"0x00980901", 131}};
  const V4l2Camera camera(settings);
  EXPECT_EQ(statistic(camera, "control_brightness"), 99);
  EXPECT_EQ(statistic(camera, "control_gain"), 17);
  EXPECT_EQ(statistic(camera, "control_contrast"), 131);
  EXPECT_EQ(statistic(camera, "control_gain_automatic"), 0);
  const auto device = kernel_v4l2_device();
  ASSERT_EQ(device->open("/dev/video0"), 0);
  V4l2Controls controls(*device);
  EXPECT_EQ(controls.get(controls.find("brightness")->id), 99);
  EXPECT_EQ(controls.get(controls.find("gain_automatic")->id), 0);
  controls.set("brightness", 128);
  controls.set("contrast", 128);

  settings.controls = {{"sharpness", 1}};
  std::string message;
  try {
    V4l2Camera unknown(settings);
  } catch (const InputError& error) {
    message = error.what();
  }
  EXPECT_THAT(message,
              HasSubstr("controls: found 'sharpness', expected one of: brightness, contrast, saturation, hue"));
}

TEST_F(V4l2Guest, ASizeThatVividDoesNotHaveIsRefusedWithWhatItGives) {
  V4l2CameraSettings settings = vivid(PixelFormat::kGrey, 1);
  settings.width = 333;
  std::string message;
  try {
    V4l2Camera camera(settings);
  } catch (const InputError& error) {
    message = error.what();
  }
  EXPECT_THAT(message, HasSubstr("asked for 333x180 field order any, the device gives: GREY 320x180"));
}

TEST_F(V4l2Guest, DroppedBuffersAreCountedAsLost) {
  set_vivid("percentage_of_dropped_buffers", 30);
  V4l2Camera camera(vivid(PixelFormat::kGrey, 1));
  ASSERT_TRUE(camera.start().ok());
  const auto frames = grab(camera, 40);
  ASSERT_EQ(frames.size(), 40u);
  const CameraCounters counters = camera.counters();
  EXPECT_GT(counters.lost, 0u);
  EXPECT_EQ(frames.back().sequence - frames.front().sequence + 1, 40 + counters.lost + counters.overrun);
}

TEST_F(V4l2Guest, BuffersWithAnErrorAreCountedAndNotDelivered) {
  V4l2Camera camera(vivid(PixelFormat::kGrey, 1));
  ASSERT_TRUE(camera.start().ok());
  grab(camera, 3);
  set_vivid("inject_v4l2_buf_flag_error", 1);
  grab(camera, 5);
  EXPECT_EQ(camera.counters().incomplete, 1u);
  EXPECT_EQ(statistic(camera, "error_buffers"), 1);
}

TEST_F(V4l2Guest, AFatalStreamErrorBeginsTheStreamAnew) {
  V4l2Camera camera(vivid(PixelFormat::kGrey, 1));
  ASSERT_TRUE(camera.start().ok());
  const auto before = grab(camera, 3);
  set_vivid("inject_fatal_streaming_error", 1);
  const auto after = grab(camera, 10);
  ASSERT_EQ(after.size(), 10u);
  EXPECT_EQ(statistic(camera, "stream_errors"), 1);
  EXPECT_GT(after.front().sequence, before.back().sequence) << "the count goes on over the restart";
}

TEST_F(V4l2Guest, AStartThatVividRefusesIsAnErrorAndTheNextOneWorks) {
  V4l2Camera camera(vivid(PixelFormat::kGrey, 1));
  set_vivid("inject_vidioc_streamon_error", 1);
  EXPECT_FALSE(camera.start().ok());
  EXPECT_TRUE(camera.start().ok());
  grab(camera, 2);
}

TEST_F(V4l2Guest, ADisconnectedCameraIsToldAndComesBack) {
  V4l2CameraSettings settings = vivid(PixelFormat::kGrey, 1);
  settings.retry = 100ms;
  V4l2Camera camera(settings);
  ASSERT_TRUE(camera.start().ok());
  const auto before = grab(camera, 3);
  set_vivid("disconnect", 1);
  // vivid registers its nodes again when the last user has closed them: the driver must let go to find it again.
  const MonotonicClock clock;
  const Stamp deadline = clock.now() + 60s;
  int told = 0;
  std::optional<Frame> frame;
  while (!frame && clock.now() < deadline) {
    auto news = camera.try_grab();
    if (!news.ok()) {
      EXPECT_EQ(news.error().code, ErrorCode::kDisconnected);
      ++told;
      MonotonicClock().sleep_until(clock.now() + 20ms);
    } else if (news.value()) {
      if (told > 0) frame = std::move(news.value());
    } else {
      camera.wait(100ms);
    }
  }
  ASSERT_TRUE(frame);
  EXPECT_GT(told, 0);
  EXPECT_EQ(statistic(camera, "disconnects"), 1);
  EXPECT_EQ(statistic(camera, "returns"), 1);
  EXPECT_GT(frame->sequence, before.back().sequence + 1) << "what was missed is counted";
  grab(camera, 5);
}

constexpr int kPictureBegins = 4;  ///< the first row of an analogue picture carries signalling

/// vivid with an S-Video input, as an analogue camera's frame grabber.
class V4l2GuestGrabber : public V4l2Guest {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists("/sys/module/vivid"))
      GTEST_SKIP() << "no vivid: run in the kernel tests' virtual machine";
    if (::geteuid() != 0) GTEST_SKIP() << "loading vivid with an analogue input needs root";
    reload("input_types=2");
    set_vivid("osd_text_mode", 2);
    set_vivid("test_pattern", kAlternatingRows);
  }
  void TearDown() override {
    if (!IsSkipped()) reload("input_types=0");
  }
  static void reload(const std::string& input) {
    const std::string command = "modprobe -r vivid && modprobe vivid vid_cap_nr=0 node_types=0x1 num_inputs=1 " +
                                input + " && udevadm settle 2>/dev/null; test -e /dev/video0";
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
  }
  static V4l2CameraSettings grabber(const std::string& field_order, FieldUse fields) {
    V4l2CameraSettings settings;
    settings.name = "bowtech";
    settings.width = 720;
    settings.height = 576;
    settings.rate_hz = 25;
    settings.channels = 1;
    settings.formats = {PixelFormat::kYuyv};
    settings.standard = "PAL";
    settings.field_order = field_order;
    settings.fields = fields;
    settings.exposure = 20ms;
    settings.timeout = 10s;
    return settings;
  }
};

TEST_F(V4l2GuestGrabber, EachFieldOfPalIsStampedTwentyMillisecondsAfterTheLast) {
  for (const std::string order : {"interlaced", "seq-tb", "alternate"}) {
    SCOPED_TRACE(order);
    V4l2Camera camera(grabber(order, FieldUse::kBoth));
    EXPECT_EQ(camera.info().height, 576);
    EXPECT_DOUBLE_EQ(camera.info().rate_hz, 50);
    ASSERT_TRUE(camera.start().ok());
    const auto frames = grab(camera, 12);
    ASSERT_EQ(frames.size(), 12u);
    for (std::size_t i = 1; i < frames.size(); ++i) {
      if (frames[i].sequence != frames[i - 1].sequence + 1) continue;
      const bool same_buffer = order != "alternate" && frames[i].sequence % 2 == 1;
      if (same_buffer) {
        EXPECT_NEAR(seconds(frames[i].stamp - frames[i - 1].stamp), 0.020, 1e-6) << "picture " << i;
      }
      // Rows are white and black in turn: each field is of one colour, and the next one of the other.
      EXPECT_GT(std::abs(frames[i].image.at<std::uint8_t>(288, 360) - frames[i - 1].image.at<std::uint8_t>(288, 360)),
                150);
    }
    const double fields_long = static_cast<double>(frames.back().sequence - frames.front().sequence);
    // Buffers are paced by the scheduler's ticks, so only the mean says something.
    EXPECT_NEAR(seconds(frames.back().stamp - frames.front().stamp) / fields_long, 0.020, 0.010);
    for (const Frame& frame : frames) {
      ASSERT_EQ(frame.image.size(), cv::Size(720, 576));
      double darkest = 0, brightest = 0;
      cv::minMaxLoc(frame.image.rowRange(kPictureBegins, 576), &darkest, &brightest);
      EXPECT_LT(brightest - darkest, 2) << "one field's rows alone";
    }
  }
}

TEST_F(V4l2GuestGrabber, WovenFieldsHaveTheirRowsInPlaceInEveryFieldOrder) {
  std::optional<cv::Mat> first;
  for (const std::string order : {"interlaced", "seq-tb", "seq-bt", "alternate"}) {
    SCOPED_TRACE(order);
    V4l2Camera camera(grabber(order, FieldUse::kWeave));
    ASSERT_TRUE(camera.start().ok());
    const auto frames = grab(camera, 2);
    ASSERT_EQ(frames.size(), 2u);
    ASSERT_EQ(frames[1].image.size(), cv::Size(720, 576));
    EXPECT_GT(std::abs(frames[1].image.at<std::uint8_t>(100, 50) - frames[1].image.at<std::uint8_t>(101, 50)), 150);
    const cv::Mat rows = frames[1].image.rowRange(kPictureBegins, 576);
    if (!first) first = rows;
    EXPECT_EQ(cv::norm(*first, rows, cv::NORM_INF), 0) << "the same picture as with interlaced rows";
  }
}

class V4l2GuestLoopback : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists("/sys/module/v4l2loopback") || !std::filesystem::exists("/dev/video10"))
      GTEST_SKIP() << "no v4l2loopback at /dev/video10: run in the kernel tests' virtual machine";
    emulation.width = 320;
    emulation.height = 240;
    emulation.rate_hz = 20;
    emulation.exposure = 8ms;
    emulation.readout = 5ms;
    reading.name = "loopback";
    reading.device = "/dev/video10";
    reading.channels = 1;
    reading.exposure = emulation.exposure;
    reading.readout = emulation.readout;
    reading.stamp_clock = StampClock::kMonotonic;
    reading.timeout = 10s;
  }

  /// Every pixel depends on the index.
  static cv::Mat picture(std::uint64_t index, int channels) {
    cv::Mat image(240, 320, CV_8UC(channels));
    for (int y = 0; y < image.rows; ++y)
      for (int x = 0; x < image.cols * channels; ++x)
        image.ptr(y)[x] = static_cast<std::uint8_t>(37 * x + 11 * y + static_cast<int>(index % 251));
    image.ptr(0)[0] = static_cast<std::uint8_t>(index % 251);
    return image;
  }
  static sim::PictureSource source(int channels) {
    return [channels](std::uint64_t index, Stamp, Duration) { return picture(index, channels); };
  }

  sim::V4l2OutputSettings emulation;
  V4l2CameraSettings reading;
};

TEST_F(V4l2GuestLoopback, WhatTheEmulatorExposesTheDriverReadsPixelForPixelAtItsMidExposure) {
  for (const PixelFormat format : {PixelFormat::kGrey, PixelFormat::kYuyv, PixelFormat::kBgr24}) {
    SCOPED_TRACE(to_string(format));
    const int channels = format == PixelFormat::kBgr24 ? 3 : 1;
    emulation.format = format;
    sim::V4l2OutputEmulator emulator(emulation, source(channels));
    reading.formats = {format};
    reading.channels = channels;
    V4l2Camera camera(reading);
    EXPECT_EQ(camera.info().width, 320);
    ASSERT_TRUE(camera.start().ok());
    const auto frames = grab(camera, 20);
    ASSERT_EQ(frames.size(), 20u);
    for (const Frame& frame : frames) {
      const double since = seconds(frame.stamp - emulator.epoch()) - 0.004;
      const auto index = static_cast<std::uint64_t>(std::lround(since * emulation.rate_hz));
      EXPECT_NEAR(since, static_cast<double>(index) / emulation.rate_hz, 2e-6) << "exact to the microsecond";
      EXPECT_EQ(cv::norm(frame.image, picture(index, channels), cv::NORM_INF), 0) << "picture " << index;
    }
    EXPECT_EQ(statistic(camera, "stamps_monotonic"), 20);
  }
}

TEST_F(V4l2GuestLoopback, UndeclaredStampsAreNotTrustedByDefault) {
  sim::V4l2OutputEmulator emulator(emulation, source(1));
  reading.stamp_clock = StampClock::kDeclared;
  V4l2Camera camera(reading);
  ASSERT_TRUE(camera.start().ok());
  const auto frames = grab(camera, 5);
  EXPECT_EQ(statistic(camera, "stamps_by_arrival"), 5);
  EXPECT_GT(frames.back().stamp_sigma, reading.stamp_sigma);
}

TEST_F(V4l2GuestLoopback, AStalledEmulatorIsATimeOutAndItsReturnIsNews) {
  sim::V4l2OutputEmulator emulator(emulation, source(1));
  reading.timeout = 500ms;
  V4l2Camera camera(reading);
  ASSERT_TRUE(camera.start().ok());
  grab(camera, 3);
  emulator.stall(true);
  const MonotonicClock clock;
  std::optional<Error> error;
  for (const Stamp deadline = clock.now() + 30s; !error && clock.now() < deadline; camera.wait(50ms))
    if (const auto news = camera.try_grab(); !news.ok()) error = news.error();
  ASSERT_TRUE(error);
  EXPECT_EQ(error->code, ErrorCode::kTimeout);
  emulator.stall(false);
  grab(camera, 3);
  EXPECT_GT(camera.counters().lost + camera.counters().overrun, 0u) << "the stamps tell what was missed";
}

TEST_F(V4l2GuestLoopback, WrittenPicturesAreCountedByTheKernel) {
  emulation.stamped = false;
  sim::V4l2OutputEmulator emulator(emulation, source(1));
  V4l2Camera camera(reading);
  ASSERT_TRUE(camera.start().ok());
  const auto frames = grab(camera, 10);
  ASSERT_EQ(frames.size(), 10u);
  for (std::size_t i = 1; i < frames.size(); ++i) EXPECT_GT(frames[i].sequence, frames[i - 1].sequence);
}

TEST_F(V4l2GuestLoopback, V4l2CtlSeesAndStreamsTheEmulatedCamera) {
  if (std::system("v4l2-ctl --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "v4l2-ctl is not installed";
  // v4l2loopback may write a picture over one that is being read: each waits here until v4l2-ctl, however late, has
  // written the last one out. Without stdbuf the end of a picture would stay in v4l2-ctl.
  constexpr std::size_t kPicture = 320 * 240;
  std::mutex mutex;
  std::condition_variable wake;
  std::size_t given = 0, read = 0;
  const auto read_on = [&](std::size_t pictures) {
    {
      const std::lock_guard lock(mutex);
      read = pictures;
    }
    wake.notify_all();
  };
  const auto give = [&](std::uint64_t index, Stamp, Duration) {
    std::unique_lock lock(mutex);
    wake.wait(lock, [&] { return given <= read; });
    ++given;
    return picture(index, 1);
  };
  sim::V4l2OutputEmulator emulator(emulation, give);
  const auto run = [&](const std::string& command) {
    std::string output;
    FILE* pipe = ::popen(command.c_str(), "r");
    char bytes[65536];
    for (ssize_t n; (n = ::read(::fileno(pipe), bytes, sizeof bytes)) > 0; read_on(output.size() / kPicture))
      output.append(bytes, static_cast<std::size_t>(n));
    return std::pair(::pclose(pipe), output);
  };
  const auto [seen, text] = run("v4l2-ctl -d /dev/video10 --get-fmt-video --list-formats 2>&1");
  EXPECT_EQ(seen, 0);
  EXPECT_THAT(text, HasSubstr("320/240"));
  EXPECT_THAT(text, HasSubstr("'GREY'"));
  const auto [streamed, bytes] =
      run("timeout 60 stdbuf -o0 v4l2-ctl -d /dev/video10 --stream-mmap --stream-count=15 --stream-to=- 2>/dev/null");
  read_on(1000);  // the emulator's thread may end
  EXPECT_EQ(streamed, 0);
  ASSERT_EQ(bytes.size(), 15 * kPicture);
  for (std::size_t i = 0; i < 15; ++i) {
    const auto index = static_cast<std::uint8_t>(bytes[i * kPicture]);  // its first pixel
    const cv::Mat truth = picture(index, 1);
    EXPECT_EQ(std::memcmp(truth.data, bytes.data() + i * kPicture, kPicture), 0) << "picture " << i;
  }
}

TEST_F(V4l2GuestLoopback, OnlyAnOutputDeviceIsTaken) {
  emulation.device = "/dev/video0";
  std::string message;
  try {
    sim::V4l2OutputEmulator emulator(emulation, source(1));
  } catch (const InputError& error) {
    message = error.what();
  }
  EXPECT_THAT(message, HasSubstr("/dev/video0: is no output device"));
}

}  // namespace
}  // namespace tankrig
