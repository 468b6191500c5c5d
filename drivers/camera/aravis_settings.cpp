// A GigE Vision camera in the rig file.
#include <map>

#include "core/config_node.hpp"
#include "drivers/camera/aravis_camera.hpp"
#include "drivers/camera/aravis_pixels.hpp"

namespace tankrig {
namespace {

Duration microseconds_of(double us) { return from_seconds(us * 1e-6); }

}  // namespace

AravisSettings aravis_settings_from(const ConfigNode& node, const CameraInfo& info) {
  using Settings = AravisSettings;
  Settings s;
  s.info = info;
  s.address = node.text_or("address", "");
  s.serial = node.text_or("serial", "");
  if (s.address.empty() && s.serial.empty()) node.fail("address", "found neither address nor serial, expected one");
  s.discovery_timeout = from_seconds(node.number_or("discovery_timeout_s", 5, {0.1, 60}));
  s.offset_x = node.integer_or("offset_x_px", 0, {0, 65535});
  s.offset_y = node.integer_or("offset_y_px", 0, {0, 65535});
  s.pixel_format = node.text_or("pixel_format", "");
  if (!s.pixel_format.empty() && !aravis_pixels(s.pixel_format))
    node.fail("pixel_format",
              "found " + s.pixel_format +
                  ", expected one of Mono8, Mono16, RGB8, BGR8, BayerRG8, BayerGB8, BayerGR8, BayerBG8");
  s.exposure_us = node.number_or("exposure_us", s.exposure_us, {1, 1e7});
  if (node.has("gain_db")) s.gain_db = node.number("gain_db", {-60, 60});
  if (node.has("gain_raw")) s.gain_raw = node.integer("gain_raw", {0, 1 << 20});
  if (s.gain_db && s.gain_raw) node.fail("gain_raw", "found gain_db and gain_raw, expected one");
  s.trigger = node.text_or("trigger", "off");
  if (s.trigger != "off" && s.trigger != "software" && !s.trigger.starts_with("Line"))
    node.fail("trigger", "found " + s.trigger + ", expected off, software, or a line of the camera such as Line1");
  s.packet_size = node.integer_or("packet_size_bytes", 0, {0, 65000});
  if (s.packet_size > 0 && s.packet_size < 576)
    node.fail("packet_size_bytes", "expected 0 (automatic) or 576 .. 65000");
  s.packet_resend = node.flag_or("packet_resend", true);
  if (node.has("socket")) {
    static const std::map<std::string, Settings::Socket> kinds = {{"auto", Settings::Socket::kAuto},
                                                                  {"datagram", Settings::Socket::kDatagram},
                                                                  {"packet", Settings::Socket::kPacket}};
    s.socket = kinds.at(node.choice("socket", {"auto", "datagram", "packet"}));
  }
  s.buffers = node.integer_or("buffers", s.buffers, {2, 256});
  if (node.has("stamp_at")) {
    static const std::map<std::string, Settings::StampAt> moments = {
        {"exposure_start", Settings::StampAt::kExposureStart},
        {"exposure_end", Settings::StampAt::kExposureEnd},
        {"frame_start", Settings::StampAt::kTransferStart}};
    s.stamp_at = moments.at(node.choice("stamp_at", {"exposure_start", "exposure_end", "frame_start"}));
  }
  s.chunk_stamps = node.flag_or("chunk_stamps", false);
  s.readout = microseconds_of(node.number_or("readout_us", 0, {0, 1e6}));
  s.transfer_delay = microseconds_of(node.number_or("transfer_delay_us", 200, {0, 1e6}));
  s.transfer_delay_sigma = microseconds_of(node.number_or("transfer_delay_sigma_us", 500, {0, 1e6}));
  s.clock_interval = from_seconds(node.number_or("clock_interval_s", 1, {0.05, 60}));
  s.use_latch = node.flag_or("timestamp_latch", true);
  s.stall_periods = node.integer_or("stall_periods", s.stall_periods, {2, 10000});
  return s;
}

}  // namespace tankrig
