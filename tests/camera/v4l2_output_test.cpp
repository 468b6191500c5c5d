// The emulated V4L2 camera: its pictures on the wire, its pace, and its errors, on a scripted output device.
#include "sim_backends/wire/v4l2_output.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <poll.h>

#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <utility>

#include "core/clock.hpp"
#include "core/input_error.hpp"
#include "core/settings_table.hpp"
#include "sim_backends/wire/v4l2_encode.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::sim {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

struct Sent {
  std::vector<std::uint8_t> bytes;
  Stamp stamp{};
  Stamp when{};
};

/// What reached the device.
/// Threads: any.
struct OutputScript {
  int open_fails = 0;
  std::uint32_t capabilities = V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING;
  std::uint32_t only_format = 0;  ///< 0: takes any
  std::atomic<bool> full = false;

  std::mutex mutex;
  std::condition_variable news;
  std::vector<Sent> sent;
  bool open = false;
  int mapped = 0;

  /// Waits until `count` pictures came.
  std::vector<Sent> wait_for(std::size_t count) {
    std::unique_lock lock(mutex);
    EXPECT_TRUE(news.wait_for(lock, 30s, [&] { return sent.size() >= count; }));
    return sent;
  }
};

class ScriptedOutput final : public V4l2Device {
 public:
  explicit ScriptedOutput(std::shared_ptr<OutputScript> script) : script_(std::move(script)) {}
  int open(const std::string&) noexcept override {
    script_->open = script_->open_fails == 0;
    return script_->open_fails;
  }
  void close() noexcept override { script_->open = false; }
  std::uint8_t* map(std::size_t, std::int64_t offset) noexcept override {
    ++script_->mapped;
    return memory_[static_cast<std::size_t>(offset)].data();
  }
  void unmap(std::uint8_t*, std::size_t) noexcept override { --script_->mapped; }
  short wait(short, Duration) noexcept override { return script_->full ? short{0} : short{POLLOUT}; }
  int write(const std::uint8_t* bytes, std::size_t size) noexcept override {
    record({{bytes, bytes + size}, {}, now()});
    return 0;
  }
  Stamp now() const noexcept override { return MonotonicClock().now(); }
  int call(unsigned long request, void* argument) noexcept override {
    switch (request) {
      case VIDIOC_QUERYCAP: {
        auto& out = *static_cast<v4l2_capability*>(argument);
        out.capabilities = V4L2_CAP_DEVICE_CAPS;
        out.device_caps = script_->capabilities;
        return 0;
      }
      case VIDIOC_S_FMT: {
        v4l2_pix_format& pix = static_cast<v4l2_format*>(argument)->fmt.pix;
        if (script_->only_format != 0) pix.pixelformat = script_->only_format;
        pix.bytesperline = pix.width * (pix.pixelformat == V4L2_PIX_FMT_GREY   ? 1
                                        : pix.pixelformat == V4L2_PIX_FMT_YUYV ? 2
                                                                               : 3);
        pix.sizeimage = pix.bytesperline * pix.height;
        size_ = pix.sizeimage;
        return 0;
      }
      case VIDIOC_REQBUFS: {
        auto& out = *static_cast<v4l2_requestbuffers*>(argument);
        out.count = 2;
        memory_.assign(2, std::vector<std::uint8_t>(size_));
        return 0;
      }
      case VIDIOC_QUERYBUF: {
        auto& out = *static_cast<v4l2_buffer*>(argument);
        out.length = static_cast<std::uint32_t>(size_);
        out.m.offset = out.index;
        return 0;
      }
      case VIDIOC_QBUF: {
        const auto& in = *static_cast<v4l2_buffer*>(argument);
        record({memory_[in.index], Stamp{in.timestamp.tv_sec * 1'000'000'000 + in.timestamp.tv_usec * 1000}, now()});
        free_ = in.index;
        return 0;
      }
      case VIDIOC_DQBUF:
        if (script_->full) return EAGAIN;
        static_cast<v4l2_buffer*>(argument)->index = free_;
        return 0;
      default:
        return 0;
    }
  }

 private:
  void record(Sent one) {
    const std::lock_guard lock(script_->mutex);
    script_->sent.push_back(std::move(one));
    script_->news.notify_all();
  }
  std::shared_ptr<OutputScript> script_;
  std::vector<std::vector<std::uint8_t>> memory_;
  std::size_t size_ = 0;
  std::uint32_t free_ = 0;
};

class V4l2Output : public ::testing::Test {
 protected:
  V4l2Output() {
    settings.width = 6;
    settings.height = 2;
    settings.rate_hz = 100;
    settings.exposure = 4ms;
    settings.readout = 1ms;
  }
  std::unique_ptr<V4l2OutputEmulator> emulator(PictureSource source) {
    return std::make_unique<V4l2OutputEmulator>(settings, std::move(source), std::make_unique<ScriptedOutput>(script));
  }
  static cv::Mat of_index(std::uint64_t index) {
    return cv::Mat(2, 6, CV_8UC1, cv::Scalar(static_cast<double>(index % 256)));
  }
  static double statistic(const V4l2OutputEmulator& one, const std::string& name) {
    for (const Statistic& s : one.statistics())
      if (s.name == name) return s.value;
    return -1;
  }

  std::shared_ptr<OutputScript> script = std::make_shared<OutputScript>();
  V4l2OutputSettings settings;
};

TEST_F(V4l2Output, EachPictureIsAskedForAfterItsExposureAndStampedAtTheEndOfItsReadOut) {
  std::mutex mutex;
  std::vector<std::pair<std::uint64_t, Stamp>> asked;
  const auto sut = emulator([&](std::uint64_t index, Stamp begin, Duration exposure) {
    EXPECT_EQ(exposure, Duration{4ms});
    EXPECT_GE(MonotonicClock().now(), begin + exposure);
    const std::lock_guard lock(mutex);
    asked.emplace_back(index, begin);
    return of_index(index);
  });
  const auto sent = script->wait_for(8);
  const std::lock_guard lock(mutex);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(asked[i].second, sut->epoch() + from_seconds(static_cast<double>(asked[i].first) / 100));
    const Stamp end = asked[i].second + 5ms;
    EXPECT_LT(end - sent[i].stamp, Duration{1us}) << "to the wire's microsecond";
    EXPECT_GE(end, sent[i].stamp);
    EXPECT_GE(sent[i].when, end);
    EXPECT_EQ(sent[i].bytes, std::vector<std::uint8_t>(12, static_cast<std::uint8_t>(asked[i].first)));
  }
}

TEST_F(V4l2Output, PicturesThatComeTooLateAreSkippedAndCounted) {
  bool first = true;
  const auto sut = emulator([&](std::uint64_t index, Stamp, Duration) {
    if (std::exchange(first, false)) MonotonicClock().sleep_until(MonotonicClock().now() + 80ms);
    return of_index(index);
  });
  const auto sent = script->wait_for(3);
  EXPECT_GE(seconds(sent[1].stamp - sent[0].stamp), 0.069) << "seven periods on, at least";
  EXPECT_GE(statistic(*sut, "skipped"), 6);
}

TEST_F(V4l2Output, WhatIsNoPictureOfItsSizeIsRefusedAndADeviceWithoutRoomIsAFailure) {
  const auto sut = emulator([&](std::uint64_t index, Stamp, Duration) {
    if (index == 1) return cv::Mat(2, 4, CV_8UC1, cv::Scalar(1));
    if (index == 2) return cv::Mat(2, 6, CV_16UC1, cv::Scalar(1));
    if (index == 3) return cv::Mat();
    return of_index(index);
  });
  script->wait_for(3);
  EXPECT_GE(statistic(*sut, "refused") + statistic(*sut, "skipped"), 3);
  script->full = true;
  const MonotonicClock clock;
  for (const Stamp deadline = clock.now() + 30s; statistic(*sut, "failed") == 0 && clock.now() < deadline;)
    MonotonicClock().sleep_until(clock.now() + 5ms);
  EXPECT_GT(statistic(*sut, "failed"), 0);
}

TEST_F(V4l2Output, ItStopsWhileItWaitsForAPicturesTime) {
  settings.rate_hz = 0.1;
  settings.exposure = 9s;
  const Stamp begin = MonotonicClock().now();
  emulator([](std::uint64_t index, Stamp, Duration) { return of_index(index); }).reset();
  EXPECT_LT(MonotonicClock().now() - begin, Duration{5s});
  EXPECT_FALSE(script->open);
  EXPECT_EQ(script->mapped, 0);
}

TEST_F(V4l2Output, WithoutBuffersOrStampsItWritesAfterABlackPicture) {
  settings.stamped = false;
  const auto sut = emulator([](std::uint64_t index, Stamp, Duration) { return of_index(50 + index % 200); });
  const auto sent = script->wait_for(3);
  EXPECT_EQ(sent[0].bytes, std::vector<std::uint8_t>(12, 0)) << "so that readers may open the device at once";
  EXPECT_GE(sent[1].bytes[0], 50);
  EXPECT_EQ(script->mapped, 0);
}

TEST_F(V4l2Output, OpeningErrorsSayWhatToDo) {
  const auto refusal = [&] {
    return message_of<InputError>([&] { emulator([](std::uint64_t, Stamp, Duration) { return cv::Mat(); }); });
  };
  script->open_fails = ENOENT;
  EXPECT_EQ(refusal(), "/dev/video10: no such device: sudo modprobe v4l2loopback video_nr=10 exclusive_caps=1");
  script->open_fails = EACCES;
  EXPECT_THAT(refusal(), HasSubstr("no permission"));
  script->open_fails = 0;
  script->capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  EXPECT_THAT(refusal(), HasSubstr("is no output device, or has a writer already"));
  script->capabilities = V4L2_CAP_VIDEO_OUTPUT;
  script->only_format = V4L2_PIX_FMT_YUYV;
  EXPECT_THAT(refusal(), HasSubstr("takes only YUYV 6x2 now"));
}

TEST_F(V4l2Output, AFolderOfPicturesIsPlayedInOrderOrByChoice) {
  const TemporaryFolder folder;
  cv::imwrite((folder.path() / "b.png").string(), cv::Mat(2, 6, CV_8UC3, cv::Scalar(1, 2, 3)));
  folder.write("a.raw", std::string(12, '\x07'));
  folder.write("c.raw", std::string(36, '\x09'));
  folder.write("notes.txt", "no picture");
  PictureSource source = pictures_of_folder(folder.path(), 6, 2);
  EXPECT_EQ(source(0, {}, {}).at<std::uint8_t>(1, 5), 7);
  EXPECT_EQ(source(1, {}, {}).at<cv::Vec3b>(0, 0), cv::Vec3b(1, 2, 3));
  EXPECT_EQ(source(2, {}, {}).channels(), 3);
  EXPECT_EQ(source(3, {}, {}).at<std::uint8_t>(0, 0), 7);
  source = pictures_of_folder(folder.path(), 6, 2,
                              [](std::uint64_t, Stamp begin, Duration) { return static_cast<std::size_t>(begin.ns); });
  EXPECT_EQ(source(0, {2}, {}).at<cv::Vec3b>(0, 0), cv::Vec3b(9, 9, 9));

  EXPECT_THAT(message_of<InputError>([&] { pictures_of_folder(folder.path(), 8, 2); }),
              HasSubstr("a.raw: expected 8x2"));
  EXPECT_THAT(message_of<InputError>([&] { pictures_of_folder(folder.path() / "none", 8, 2); }),
              HasSubstr("no picture here"));
}

TEST(V4l2OutputSettings, AreReadStrictly) {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& yaml) {
    const ConfigNode node = ConfigNode::load(folder.write("rig.yaml", yaml));
    const V4l2OutputSettings got = settings_from(node, kV4l2OutputKeys);
    node.finish();
    return got;
  };
  const V4l2OutputSettings got = read(
      "device: /dev/video11\nwidth_px: 720\nheight_px: 576\nrate_hz: 12.5\npixel_format: YUYV\nexposure_s: "
      "0.02\nreadout_s: 0.01\nstamped: false\n");
  EXPECT_EQ(got.device, "/dev/video11");
  EXPECT_EQ(got.height, 576);
  EXPECT_EQ(got.rate_hz, 12.5);
  EXPECT_EQ(got.format, PixelFormat::kYuyv);
  EXPECT_EQ(got.exposure, Duration{20ms});
  EXPECT_EQ(got.readout, Duration{10ms});
  EXPECT_FALSE(got.stamped);
  EXPECT_THAT(message_of<InputError>([&] { read("pixel_format: MJPEG\n"); }), HasSubstr("rig.yaml:1: pixel_format"));
  EXPECT_THAT(message_of<InputError>([&] { read("pixel_format: YUYV\nwidth_px: 33\n"); }),
              HasSubstr("expected an even width"));
  EXPECT_THAT(message_of<InputError>([&] { read("exposure_s: 0.1\n"); }), HasSubstr("frame period"));
  EXPECT_THAT(message_of<InputError>([&] { read("rate: 3\n"); }), HasSubstr("rate"));
}

std::vector<std::uint8_t> encoded(const cv::Mat& picture, PixelFormat format) {
  const std::size_t stride = row_bytes(format, picture.cols) + 3;
  std::vector<std::uint8_t> out(picture_bytes(format, picture.cols, picture.rows, stride));
  EXPECT_TRUE(encode(picture, format, stride, out));
  return out;
}

TEST(V4l2Encode, ColoursAreCodedByBt601) {
  const cv::Mat red(1, 2, CV_8UC3, cv::Scalar(0, 0, 255)), white(1, 2, CV_8UC3, cv::Scalar::all(255));
  EXPECT_EQ(encoded(red, PixelFormat::kYuyv), (std::vector<std::uint8_t>{81, 90, 81, 240}));
  EXPECT_EQ(encoded(white, PixelFormat::kYuyv), (std::vector<std::uint8_t>{235, 128, 235, 128}));
  EXPECT_EQ(encoded(red, PixelFormat::kGrey), (std::vector<std::uint8_t>{76, 76}));
  EXPECT_EQ(encoded(red, PixelFormat::kBgr24), (std::vector<std::uint8_t>{0, 0, 255, 0, 0, 255}));
}

TEST(V4l2Encode, WhatIsCodedIsDecodedAgain) {
  std::mt19937 random(11);
  cv::Mat grey(6, 10, CV_8UC1), colour(6, 10, CV_8UC3);
  for (int i = 0; i < 60; ++i) grey.data[i] = static_cast<std::uint8_t>(random());
  for (int i = 0; i < 60; i += 2)  // neighbours alike: chroma is shared by two
    colour.at<cv::Vec3b>(i) = colour.at<cv::Vec3b>(i + 1) = cv::Vec3b(
        static_cast<std::uint8_t>(random()), static_cast<std::uint8_t>(random()), static_cast<std::uint8_t>(random()));
  for (const PixelFormat format : {PixelFormat::kGrey, PixelFormat::kYuyv, PixelFormat::kBgr24}) {
    const std::size_t stride = row_bytes(format, 10) + 3;
    const auto bytes = encoded(grey, format);
    const auto back = to_image({format, 10, 6, stride, bytes, false}, 1);
    ASSERT_TRUE(back.ok());
    EXPECT_EQ(cv::norm(back.value(), grey, cv::NORM_INF), 0) << to_string(format);
  }
  const auto bytes = encoded(colour, PixelFormat::kYuyv);
  const auto back = to_image({PixelFormat::kYuyv, 10, 6, 23, bytes, false}, 3);
  ASSERT_TRUE(back.ok());
  EXPECT_LE(cv::norm(back.value(), colour, cv::NORM_INF), 4);
}

TEST(V4l2Encode, WhatDoesNotFitIsRefused) {
  std::vector<std::uint8_t> out(100);
  EXPECT_FALSE(encode(cv::Mat(2, 5, CV_8UC1), PixelFormat::kYuyv, 10, out)) << "odd width";
  EXPECT_FALSE(encode(cv::Mat(20, 6, CV_8UC1), PixelFormat::kGrey, 6, out)) << "too many rows";
  EXPECT_FALSE(encode(cv::Mat(2, 6, CV_8UC1), PixelFormat::kGrey, 5, out)) << "rows too close";
  EXPECT_FALSE(encode(cv::Mat(2, 6, CV_8UC1), PixelFormat::kUyvy, 12, out));
  EXPECT_FALSE(encode(cv::Mat(), PixelFormat::kGrey, 12, out));
  EXPECT_FALSE(encode(cv::Mat(2, 6, CV_32FC1), PixelFormat::kGrey, 24, out));
}

}  // namespace
}  // namespace tankrig::sim
