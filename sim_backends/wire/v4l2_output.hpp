// An emulated camera on a Video for Linux output device, such as v4l2loopback's: a V4L2 camera driver reads its
// pictures at the other end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

#include "core/config_node.hpp"
#include "core/time.hpp"
#include "drivers/camera/pixel_format.hpp"
#include "drivers/camera/v4l2_device.hpp"
#include "drivers/statistics.hpp"

namespace tankrig::sim {

struct V4l2OutputSettings {
  std::string device = "/dev/video10";
  int width = 640, height = 480;  ///< [px]
  double rate_hz = 25;
  PixelFormat format = PixelFormat::kGrey;  ///< kGrey, kYuyv or kBgr24
  Duration exposure = std::chrono::milliseconds{10};
  Duration readout{};  ///< from the end of the exposure to the picture's end on the wire
  /// True: buffers carry the end of the read-out as their stamp, exact however late the picture was (v4l2loopback then
  /// counts no sequence). False, or without buffers: pictures are written, and the kernel stamps and counts them then.
  bool stamped = true;
};

/// A camera of the rig file's `emulation: v4l2_outputs:`.
extern const SettingsTable<V4l2OutputSettings> kV4l2OutputKeys;

/// Renders exposure `index`, which began at `begin`: 8-bit, 1 or 3 (BGR) channels, of the device's size.
using PictureSource = std::function<cv::Mat(std::uint64_t index, Stamp begin, Duration exposure)>;
/// Which picture of a folder that exposure shows.
using PictureChoice = std::function<std::size_t(std::uint64_t index, Stamp begin, Duration exposure)>;

/// Plays the pictures of a folder, in the order of their names: *.png, or *.raw (width * height grey bytes, or three
/// times as many BGR ones). Reads all of them now. Without `choice`, they repeat in order.
/// Errors: InputError if there is none, or one is not `width` x `height`.
PictureSource pictures_of_folder(const std::filesystem::path& folder, int width, int height, PictureChoice choice = {});

/// Exposes at `rate_hz` on CLOCK_MONOTONIC: frame n begins at epoch + n / rate and is requested after its exposure. One
/// more than a period late is skipped and counted.
/// Threads: its own calls `source`; the destructor stops it within one picture.
/// RT: never.
/// Errors: the constructor throws InputError, one line that says what to do.
class V4l2OutputEmulator {
 public:
  V4l2OutputEmulator(const V4l2OutputSettings& settings, PictureSource source)
      : V4l2OutputEmulator(settings, std::move(source), kernel_v4l2_device()) {}
  V4l2OutputEmulator(const V4l2OutputSettings& settings, PictureSource source, std::unique_ptr<V4l2Device> device);
  ~V4l2OutputEmulator();
  V4l2OutputEmulator(const V4l2OutputEmulator&) = delete;
  V4l2OutputEmulator& operator=(const V4l2OutputEmulator&) = delete;

  /// When frame 0 began.
  Stamp epoch() const;
  /// Stops pictures, as a stalled camera; and starts them again.
  void stall(bool stalled);
  /// written, skipped, refused (wrong size or type), failed (the device would not)
  Statistics statistics() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tankrig::sim
