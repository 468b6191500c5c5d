// The Aravis camera's part of a rig file, and the pictures it makes of each pixel format.
#include <gtest/gtest.h>

#include "core/config_node.hpp"
#include "core/input_error.hpp"
#include "drivers/camera/aravis_camera.hpp"
#include "drivers/camera/aravis_pixels.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

const CameraInfo kInfo{"left", 640, 480, 3, 25};

AravisSettings read(const std::string& text) {
  const TemporaryFolder folder;
  const ConfigNode node = ConfigNode::load(folder.write("camera.yaml", text));
  const AravisSettings settings = aravis_settings_from(node, kInfo);
  node.finish();
  return settings;
}

std::string error_of(const std::string& text) {
  const std::string message = message_of<InputError>([&] { read(text); });
  return message.substr(message.find("camera.yaml"));
}

TEST(AravisSettings, NeedNoMoreThanAnAddress) {
  const AravisSettings s = read("address: 192.168.7.2\n");
  EXPECT_EQ(s.address, "192.168.7.2");
  EXPECT_EQ(s.info.name, "left");
  EXPECT_EQ(s.trigger, "off");
  EXPECT_EQ(s.packet_size, 0);
  EXPECT_EQ(s.socket, AravisSettings::Socket::kAuto);
  EXPECT_EQ(s.stamp_at, AravisSettings::StampAt::kExposureStart);
}

TEST(AravisSettings, AreAllRead) {
  const AravisSettings s = read(
      "serial: '4711'\ndiscovery_timeout_s: 2.5\noffset_x_px: 8\noffset_y_px: 16\npixel_format: BayerRG8\n"
      "exposure_us: 5000\ngain_db: 6\ntrigger: Line1\npacket_size_bytes: 9000\npacket_resend: false\nsocket: datagram\n"
      "buffers: 16\nstamp_at: frame_start\nchunk_stamps: true\nreadout_us: 12000\ntransfer_delay_us: 150\n"
      "transfer_delay_sigma_us: 60\nclock_interval_s: 2\ntimestamp_latch: false\nstall_periods: 20\n");
  EXPECT_EQ(s.serial, "4711");
  EXPECT_EQ(s.discovery_timeout, std::chrono::milliseconds(2500));
  EXPECT_EQ(s.offset_x, 8);
  EXPECT_EQ(s.offset_y, 16);
  EXPECT_EQ(s.pixel_format, "BayerRG8");
  EXPECT_EQ(s.exposure_us, 5000);
  EXPECT_EQ(s.gain_db, 6);
  EXPECT_EQ(s.trigger, "Line1");
  EXPECT_EQ(s.packet_size, 9000);
  EXPECT_FALSE(s.packet_resend);
  EXPECT_EQ(s.socket, AravisSettings::Socket::kDatagram);
  EXPECT_EQ(s.buffers, 16);
  EXPECT_EQ(s.stamp_at, AravisSettings::StampAt::kTransferStart);
  EXPECT_TRUE(s.chunk_stamps);
  EXPECT_EQ(s.readout, std::chrono::milliseconds(12));
  EXPECT_EQ(s.transfer_delay, std::chrono::microseconds(150));
  EXPECT_EQ(s.transfer_delay_sigma, std::chrono::microseconds(60));
  EXPECT_EQ(s.clock_interval, std::chrono::seconds(2));
  EXPECT_FALSE(s.use_latch);
  EXPECT_EQ(s.stall_periods, 20);
}

TEST(AravisSettings, RefuseWhatMakesNoSense) {
  EXPECT_EQ(error_of("trigger: 'off'\n"), "camera.yaml:1: address: found neither address nor serial, expected one");
  EXPECT_EQ(error_of("address: a\ntrigger: sometimes\n"),
            "camera.yaml:2: trigger: found sometimes, expected off, software, or a line of the camera such as Line1");
  EXPECT_EQ(error_of("address: a\npixel_format: YUV422\n"),
            "camera.yaml:2: pixel_format: found YUV422, expected one of Mono8, Mono16, RGB8, BGR8, BayerRG8, BayerGB8, "
            "BayerGR8, BayerBG8");
  EXPECT_EQ(error_of("address: a\ngain_db: 1\ngain_raw: 2\n"),
            "camera.yaml:3: gain_raw: found gain_db and gain_raw, expected one");
  EXPECT_EQ(error_of("address: a\npacket_size_bytes: 100\n"),
            "camera.yaml:2: packet_size_bytes: expected 0 (automatic) or 576 .. 65000");
  EXPECT_NE(error_of("address: a\nexposure_us: -3\n").find("exposure_us"), std::string::npos);
  EXPECT_NE(error_of("address: a\nexposure: 3\n").find("exposure"), std::string::npos) << "unknown key";
}

/// A picture of one colour, as a camera with the pixel format would send it.
cv::Mat memory_of(const std::vector<std::uint8_t>& bytes) { return cv::Mat(bytes, true).reshape(1, 1); }

TEST(AravisPixels, KnowEachBayerPattern) {
  // 4 x 4 of pure red: the red places of each pattern are 255.
  const struct {
    const char* name;
    int red_y, red_x;
  } kPatterns[] = {{"BayerRG8", 0, 0}, {"BayerGR8", 0, 1}, {"BayerGB8", 1, 0}, {"BayerBG8", 1, 1}};
  for (const auto& p : kPatterns) {
    SCOPED_TRACE(p.name);
    std::vector<std::uint8_t> bytes(64);
    for (int y = p.red_y; y < 8; y += 2)
      for (int x = p.red_x; x < 8; x += 2) bytes[static_cast<std::size_t>(8 * y + x)] = 255;
    const cv::Mat picture = picture_from(memory_of(bytes), {8, 8}, *aravis_pixels(p.name), 3);
    EXPECT_EQ(picture.at<cv::Vec3b>(4, 4), cv::Vec3b(0, 0, 255));
    EXPECT_EQ(picture.at<cv::Vec3b>(3, 3), cv::Vec3b(0, 0, 255));
    EXPECT_EQ(picture_from(memory_of(bytes), {8, 8}, *aravis_pixels(p.name), 1).channels(), 1);
  }
}

TEST(AravisPixels, ShareTheMemoryWhereNothingIsConverted) {
  const cv::Mat memory = memory_of(std::vector<std::uint8_t>(60, 9));
  EXPECT_EQ(picture_from(memory, {6, 4}, *aravis_pixels("Mono8"), 1).data, memory.data);
  EXPECT_EQ(picture_from(memory, {5, 4}, *aravis_pixels("BGR8"), 3).data, memory.data);
  EXPECT_NE(picture_from(memory, {5, 4}, *aravis_pixels("RGB8"), 3).data, memory.data);
  EXPECT_EQ(picture_from(memory, {6, 4}, *aravis_pixels("Mono8"), 1).u, memory.u) << "and keep it alive";
}

TEST(AravisPixels, KeepTheUpperByteOfMono16) {
  const cv::Mat picture =
      picture_from(memory_of({0x34, 0x12, 0xFF, 0x00, 0x00, 0xFF, 0xCD, 0xAB}), {2, 2}, *aravis_pixels("Mono16"), 1);
  EXPECT_EQ(picture.at<std::uint8_t>(0, 0), 0x12);
  EXPECT_EQ(picture.at<std::uint8_t>(0, 1), 0x00);
  EXPECT_EQ(picture.at<std::uint8_t>(1, 0), 0xFF);
  EXPECT_EQ(picture.at<std::uint8_t>(1, 1), 0xAB);
  EXPECT_FALSE(aravis_pixels("Mono12Packed"));
}

}  // namespace
}  // namespace tankrig
