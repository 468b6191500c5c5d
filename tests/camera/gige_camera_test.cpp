// The emulated GigE Vision camera as seen by others: its pixels, its latch, its network, and Aravis' own tools.
#include "sim_backends/wire/gige_camera.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iostream>

#include "core/input_error.hpp"
#include "sim_backends/wire/gige_pixels.hpp"
#include "tests/camera/gige_rig.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::testing {
namespace {

using sim::GigeCameraEmulator;
using sim::GigeCameraSettings;

cv::Mat grey(std::uint64_t index, Stamp, Duration) { return known_picture(index, {64, 48}, 1); }

GigeCameraSettings small() {
  GigeCameraSettings s;
  s.width = 64;
  s.height = 48;
  return s;
}

TEST(GigePixels, WritesEachFormatByteForByte) {
  cv::Mat picture(2, 2, CV_8UC3);
  picture.at<cv::Vec3b>(0, 0) = {1, 2, 3};
  picture.at<cv::Vec3b>(0, 1) = {4, 5, 6};
  picture.at<cv::Vec3b>(1, 0) = {7, 8, 9};
  picture.at<cv::Vec3b>(1, 1) = {10, 11, 12};
  const auto bytes = [&](const cv::Mat& from, const char* format, std::size_t count) {
    std::vector<int> out(count);
    std::vector<std::uint8_t> data(count);
    sim::write_gige_pixels(from, {}, {2, 2}, sim::gige_pixel_format(format), data.data());
    std::copy(data.begin(), data.end(), out.begin());
    return out;
  };
  EXPECT_EQ(bytes(picture, "RGB8", 12), (std::vector<int>{3, 2, 1, 6, 5, 4, 9, 8, 7, 12, 11, 10}));
  EXPECT_EQ(bytes(picture, "BayerRG8", 4), (std::vector<int>{3, 5, 8, 10}));
  EXPECT_EQ(bytes(picture, "BayerGR8", 4), (std::vector<int>{2, 6, 7, 11}));
  EXPECT_EQ(bytes(picture, "BayerGB8", 4), (std::vector<int>{2, 4, 9, 11}));
  EXPECT_EQ(bytes(picture, "BayerBG8", 4), (std::vector<int>{1, 5, 8, 12}));
  const cv::Mat mono = (cv::Mat_<std::uint8_t>(2, 2) << 1, 2, 254, 255);
  EXPECT_EQ(bytes(mono, "Mono8", 4), (std::vector<int>{1, 2, 254, 255}));
  EXPECT_EQ(bytes(mono, "Mono16", 8), (std::vector<int>{0, 1, 0, 2, 0, 254, 0, 255})) << "little-endian, upper byte";
  EXPECT_EQ(bytes(mono, "RGB8", 12), (std::vector<int>{1, 1, 1, 2, 2, 2, 254, 254, 254, 255, 255, 255}));
  EXPECT_EQ(bytes(mono, "BayerRG8", 4), (std::vector<int>{1, 2, 254, 255}));
  EXPECT_EQ(sim::gige_pixel_format("YUV422"), 0u);
}

TEST(GigePixels, CutsTheRegionAndFillsWhatThePictureLacksWithBlack) {
  const cv::Mat mono = known_picture(0, {8, 8}, 1);
  std::array<std::uint8_t, 4> data{};
  const auto format = sim::gige_pixel_format("Mono8");
  sim::write_gige_pixels(mono, {3, 5}, {2, 2}, format, data.data());
  EXPECT_EQ(data[0], mono.at<std::uint8_t>(5, 3));
  EXPECT_EQ(data[3], mono.at<std::uint8_t>(6, 4));
  sim::write_gige_pixels(mono, {7, 7}, {2, 2}, format, data.data());
  EXPECT_EQ(data[0], mono.at<std::uint8_t>(7, 7));
  EXPECT_EQ(data[1] + data[2] + data[3], 0);
}

class GigeCameraTest : public GigeTest {};

TEST_F(GigeCameraTest, RefusesWhatItCannotBe) {
  const auto error = [](GigeCameraSettings settings) {
    return message_of<InputError>([&] { GigeCameraEmulator camera(settings, grey); });
  };
  GigeCameraSettings s = small();
  s.address = "192.0.2.7";
  EXPECT_EQ(
      error(s),
      "emulated GigE camera EMULATED-1: cannot serve at 192.0.2.7: it must be an address of a network interface of "
      "this machine (ip addr add 192.0.2.7/8 dev lo) and its port 3956 must be free. `tankrig emulate ... -- COMMAND` "
      "serves it on a network of its own, `--device` leaves cameras out");
  s = small();
  s.pixel_format = "YUV422";
  EXPECT_NE(error(s).find("pixel_format is none of"), std::string::npos);
  s = small();
  s.serial = "a serial number that is too long";
  EXPECT_NE(error(s).find("1 to 15 characters"), std::string::npos);
}

TEST_F(GigeCameraTest, KeepsADeviceClockOfItsOwn) {
  GigeCameraSettings settings = small();
  settings.clock_start_ns = 42'000'000'000;
  settings.clock_drift_ppm = 100;
  GigeCameraEmulator sut(settings, grey);
  const Stamp now = MonotonicClock{}.now();
  const std::int64_t first = sut.device_time(now);
  EXPECT_GE(first, 42'000'000'000);
  EXPECT_EQ(sut.device_time(now + std::chrono::seconds(100)) - first, 100'010'000'000) << "100 ppm fast";
  sut.step_clock(std::chrono::seconds(-5));
  EXPECT_EQ(sut.device_time(now), first - 5'000'000'000);
}

TEST_F(GigeCameraTest, CostsNextToNothingWhileNobodyWatches) {
  GigeCameraEmulator sut(small(), grey);
  timespec before{}, after{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &before);
  const Stamp begin = MonotonicClock{}.now();
  MonotonicClock{}.sleep_until(begin + std::chrono::milliseconds(500));
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &after);
  const double cpu_s =
      static_cast<double>(after.tv_sec - before.tv_sec) + 1e-9 * static_cast<double>(after.tv_nsec - before.tv_nsec);
  std::cout << "idle: " << 100 * cpu_s / seconds(MonotonicClock{}.now() - begin) << " % of a core\n";
  EXPECT_LT(cpu_s, 0.05);
  EXPECT_EQ(sut.exposures(), 0u);
}

/// Output of a program in this process's network.
std::string output_of(const std::string& command) {
  std::string text;
  FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
  if (!pipe) return text;
  std::array<char, 4096> part;
  for (std::size_t n; (n = ::fread(part.data(), 1, part.size(), pipe)) > 0;) text.append(part.data(), n);
  ::pclose(pipe);
  return text;
}

bool installed(const char* program) {
  return ::system((std::string("command -v ") + program + " >/dev/null 2>&1").c_str()) == 0;
}

TEST_F(GigeCameraTest, IsSeenAndReadByArvTool) {
  if (!installed("arv-tool-0.8")) GTEST_SKIP() << "arv-tool-0.8 is not installed (aravis-tools-cli)";
  GigeCameraSettings left = small(), right = small();
  left.serial = "TANK-L";
  left.exposure_us = 7500;
  right.serial = "TANK-R";
  right.address = "127.0.0.2";
  GigeCameraEmulator left_camera(left, grey), right_camera(right, grey);
  const std::string list = output_of("timeout 20 arv-tool-0.8");
  EXPECT_NE(list.find("Aravis-Fake-TANK-L (127.0.0.1)"), std::string::npos) << list;
  EXPECT_NE(list.find("Aravis-Fake-TANK-R (127.0.0.2)"), std::string::npos) << list;
  const std::string features =
      output_of("timeout 20 arv-tool-0.8 -a 127.0.0.1 control Width Height PixelFormat ExposureTimeAbs");
  EXPECT_NE(features.find("Width = 64"), std::string::npos) << features;
  EXPECT_NE(features.find("Height = 48"), std::string::npos) << features;
  EXPECT_NE(features.find("PixelFormat = Mono8"), std::string::npos) << features;
  EXPECT_NE(features.find("ExposureTimeAbs = 7500"), std::string::npos) << features;
}

TEST_F(GigeCameraTest, StreamsToArvCameraTest) {
  if (!installed("arv-camera-test-0.8")) GTEST_SKIP() << "arv-camera-test-0.8 is not installed (aravis-tools-cli)";
  GigeCameraSettings settings = small();
  settings.serial = "TANK-L";
  GigeCameraEmulator sut(settings, grey);
  const std::string output =
      output_of("timeout 20 arv-camera-test-0.8 -n Aravis-Fake-TANK-L -f 50 --no-packet-socket --duration 2");
  const std::string kCompleted = "n_completed_buffers    = ";
  const std::size_t found = output.find(kCompleted);
  ASSERT_NE(found, std::string::npos) << output;
  EXPECT_GT(std::atoi(output.c_str() + found + kCompleted.size()), 30) << output;
}

/// 0 if an emulator can be had at 127.0.0.3 of a private network with three addresses, and none at the fourth.
int cameras_of_a_private_network() {
  const Status entered = sim::enter_private_network(3);
  if (!entered.ok()) return 1;
  const auto can_be_had = [](const char* address) {
    GigeCameraSettings settings = small();
    settings.address = address;
    try {
      GigeCameraEmulator camera(settings, grey);
    } catch (const InputError&) {
      return false;
    }
    return true;
  };
  if (!can_be_had("127.0.0.3")) return 2;
  return can_be_had("127.0.0.4") ? 3 : 0;
}

TEST_F(GigeCameraTest, FindsItsAddressesInAPrivateNetworkInsideAPrivateNetwork) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // a program of its own: a fork has this one's locks, not its threads
  EXPECT_EXIT(std::_Exit(cameras_of_a_private_network()), ::testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace tankrig::testing
