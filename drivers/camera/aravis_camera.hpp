// An industrial camera on GigE Vision (or USB3 Vision), through Aravis.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/config_node.hpp"
#include "core/enum_names.hpp"
#include "drivers/camera/camera.hpp"

namespace tankrig {

struct AravisSettings {
  CameraInfo info;  ///< name for messages, picture size, 1 or 3 channels, and the rate it runs at unless triggered
  std::string address, serial;  ///< one of them: the network address (quick), or the serial number (searched for)
  Duration discovery_timeout = std::chrono::seconds(5);
  int offset_x = 0, offset_y = 0;  ///< of the picture on the sensor [px]
  std::string pixel_format;        ///< GenICam name; empty: Mono8 for 1 channel, RGB8 for 3
  double exposure_us = 10000;
  std::optional<double> gain_db;  ///< GenICam Gain
  std::optional<int> gain_raw;    ///< GenICam GainRaw, of cameras that have no gain in decibel
  std::string trigger = "off";    ///< off: free-running | software | GenICam line, e.g. Line1 (rising edge)
  int packet_size = 0;            ///< bytes on the wire, 0: the largest that gets through
  bool packet_resend = true;
  enum class Socket { kAuto, kDatagram, kPacket } socket = Socket::kAuto;
  int buffers = 8;  ///< frames that may wait for their reader

  /// What the device stamps, in the leader of each frame: the start or the end of the exposure, or the start of the
  /// transfer, which is `readout` after the end of the exposure.
  enum class StampAt { kExposureStart, kExposureEnd, kTransferStart } stamp_at = StampAt::kExposureStart;
  bool chunk_stamps = false;  ///< the stamp is the chunk Timestamp, not the leader's
  Duration readout{};
  /// For a device whose clock cannot be read: from the end of the exposure to the first packet, and its one sigma.
  Duration transfer_delay = std::chrono::microseconds(200);
  Duration transfer_delay_sigma = std::chrono::microseconds(500);
  Duration clock_interval = std::chrono::seconds(1);  ///< between readings of the device's clock
  bool use_latch = true;                              ///< false: never ask the device's clock
  int stall_periods = 10;                             ///< without a frame (and 0.5 s at least), free-running: an error
};

template <>
inline constexpr std::array kNames<AravisSettings::Socket>{"auto", "datagram", "packet"};
template <>
inline constexpr std::array kNames<AravisSettings::StampAt>{"exposure_start", "exposure_end", "frame_start"};

/// A camera of the rig file's `devices`, with `driver: aravis`.
extern const SettingsTable<AravisSettings> kAravisKeys;

/// `node` is the camera's part of a rig file, `info` what its camera model says.
/// Errors: InputError with file and line. The caller finishes the node.
AravisSettings aravis_settings_from(const ConfigNode& node, const CameraInfo& info);

struct AravisDevice {
  std::string address, serial, vendor, model, id;
};

/// Every camera that answers a search now; takes about a second.
/// Threads: any.
std::vector<AravisDevice> find_aravis_devices();

/// Frame stamps are mid-exposure: the device's stamp, moved by half an exposure and mapped to our clock by a fitted
/// line. The line goes through readings of the device's clock (GigE Vision timestamp latch, bracketed by readings of
/// ours; sigma from the width of the bracket), taken at opening and then by the camera's own thread. A device without
/// the latch is fitted to the earliest arrivals minus `transfer_delay`, with a larger sigma. A frame is given out after
/// one more clock reading has confirmed its clock (ClockTrust).
///
/// Copies: Mono8 and BGR8 pictures are the memory that received the packets, which returns to the camera with the last
/// cv::Mat on it. Other formats are converted once.
///
/// Losses: an incomplete frame (packets missing, or smaller than promised) is counted and not given out. A frame number
/// never seen is lost, or overrun if all buffers waited for their reader. Frames not taken before stop() are unread, or
/// incomplete. Numbers count from the first frame after start(): earlier losses are not counted.
///
/// A vanished camera gives kDisconnected at every try_grab until it is back. The camera's thread finds, opens and
/// starts it again, and `sequence` goes on. A free-running camera without frames for `stall_periods` gives one
/// kTimeout; so does a clock that does not answer while a frame waits for it.
///
/// Threads: as Camera; try_grab and trigger may be in different threads. try_grab never waits for the device, and stop
/// never for a stalled one: the camera's own thread does.
/// Errors: kInternal if that thread has ended; the constructor throws InputError with what to do. The destructor takes
/// a fraction of a second, or up to 10 s for a vanished camera (Aravis' control time-outs).
class AravisCamera final : public Camera {
 public:
  explicit AravisCamera(const AravisSettings& settings);
  ~AravisCamera() override;

  CameraInfo info() const override;
  Status start() override;
  Result<std::optional<Frame>> try_grab() override;
  void stop() noexcept override;
  CameraCounters counters() const override;
  Status trigger() override;
  Statistics statistics() const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tankrig
