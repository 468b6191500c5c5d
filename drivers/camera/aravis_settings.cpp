// A GigE Vision camera in the rig file.
#include "core/settings_table.hpp"
#include "drivers/camera/aravis_camera.hpp"
#include "drivers/camera/aravis_pixels.hpp"

namespace tankrig {
namespace {

constexpr ConfigRange kOffset{0, 65535}, kMicroseconds{0, 1e6};
constexpr const char* kPixelNames = "Mono8, Mono16, RGB8, BGR8, BayerRG8, BayerGB8, BayerGR8, BayerBG8";

void read_pixel_format(const ConfigNode& node, const char* key, AravisSettings& s) {
  s.pixel_format = node.text(key);
  if (!s.pixel_format.empty() && !aravis_pixels(s.pixel_format))
    node.fail(key, "found " + s.pixel_format + ", expected one of " + kPixelNames);
}
void read_trigger(const ConfigNode& node, const char* key, AravisSettings& s) {
  s.trigger = node.text(key);
  if (s.trigger != "off" && s.trigger != "software" && !s.trigger.starts_with("Line"))
    node.fail(key, "found " + s.trigger + ", expected off, software, or a line of the camera such as Line1");
}
void write_trigger(YAML::Emitter& out, const AravisSettings& s) { out << s.trigger; }

using Aravis = AravisSettings;
const Setting<Aravis> kAravisRows[] = {
    {"address", &Aravis::address, "network address, found in milliseconds; this or `serial` is needed"},
    {"serial", &Aravis::serial, "serial number, found in about a second"},
    {"discovery_timeout_s", &Aravis::discovery_timeout, ConfigRange(0.1, 60), "longest search"},
    {"offset_x_px", &Aravis::offset_x, kOffset, "of the picture on the sensor"},
    {"offset_y_px", &Aravis::offset_y, kOffset, "likewise"},
    {"pixel_format", {read_pixel_format, nullptr, kPixelNames}, "none: Mono8 of one channel, RGB8 of three"},
    {"exposure_us", &Aravis::exposure_us, ConfigRange(1, 1e7), "automatics stay off"},
    {"gain_db", &Aravis::gain_db, ConfigRange(-60, 60), "none: the camera's"},
    {"gain_raw", &Aravis::gain_raw, ConfigRange(0, 1 << 20), "instead, of cameras that have no gain in decibel"},
    {"trigger",
     {read_trigger, write_trigger, "off, software, or a line such as Line1 (rising edge)"},
     "off: free-running at the rig camera's `rate_hz`"},
    {"packet_size_bytes", &Aravis::packet_size, ConfigRange(0, 65000),
     "0: the largest that gets through; at least 576; 9000 where the network carries jumbo frames"},
    {"packet_resend", &Aravis::packet_resend, "lost packets are asked for again"},
    {"socket", &Aravis::socket,
     "packet: needs CAP_NET_RAW, 5 ms later; auto: datagram where the receive buffer may hold two frames, else packet, "
     "else an error"},
    {"buffers", &Aravis::buffers, ConfigRange(2, 256), "frames that may wait for their reader"},
    {"stamp_at", &Aravis::stamp_at, "what the device stamps; frame_start: `readout_us` after the end of the exposure"},
    {"chunk_stamps", &Aravis::chunk_stamps, "the stamp is the chunk Timestamp instead of the leader's"},
    {"readout_us", &Aravis::readout, kMicroseconds, "from the end of the exposure to the start of the transfer"},
    {"transfer_delay_us", &Aravis::transfer_delay, kMicroseconds,
     "without the latch: stamps are earliest arrivals less this"},
    {"transfer_delay_sigma_us", &Aravis::transfer_delay_sigma, kMicroseconds, "its one sigma"},
    {"clock_interval_s", &Aravis::clock_interval, ConfigRange(0.05, 60), "between readings of the device's clock"},
    {"timestamp_latch", &Aravis::use_latch, "false: never ask the device's clock"},
    {"stall_periods", &Aravis::stall_periods, ConfigRange(2, 10000),
     "so many periods (0.5 s at least) without a frame: a free-running camera is stalled"},
};

void check_aravis(const ConfigNode& node, const Aravis& s) {
  if (s.address.empty() && s.serial.empty()) node.fail("address", "found neither address nor serial, expected one");
  if (s.gain_db && s.gain_raw) node.fail("gain_raw", "found gain_db and gain_raw, expected one");
  if (s.packet_size > 0 && s.packet_size < 576)
    node.fail("packet_size_bytes", "expected 0 (automatic) or 576 .. 65000");
}

}  // namespace

constinit const SettingsTable<AravisSettings> kAravisKeys{kAravisRows, check_aravis};

AravisSettings aravis_settings_from(const ConfigNode& node, const CameraInfo& info) {
  AravisSettings s;
  s.info = info;
  read_settings(node, kAravisKeys, s);
  return s;
}

}  // namespace tankrig
