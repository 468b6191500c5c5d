#include "drivers/camera/v4l2_settings.hpp"

#include "core/settings_table.hpp"

namespace tankrig {
namespace {

constexpr ConfigRange kSide_px{1, 1 << 14}, kUpToASecond{0, 1}, kWait{0.01, 60};

void read_formats(const ConfigNode& node, const char* key, V4l2CameraSettings& s) {
  std::vector<std::string> allowed{"auto"};
  for (const PixelFormat format : kPixelFormats) allowed.emplace_back(to_string(format));
  const std::string name = node.choice(key, allowed);
  if (name != "auto") s.formats = {*pixel_format_from(name)};
}
void write_formats(YAML::Emitter& out, const V4l2CameraSettings& s) {
  out << (s.formats.empty() ? "auto" : to_string(s.formats.front()));
}
void read_field_order(const ConfigNode& node, const char* key, V4l2CameraSettings& s) {
  s.field_order = node.choice(key, {"any", "none", "interlaced", "interlaced-tb", "interlaced-bt", "seq-tb", "seq-bt",
                                    "alternate", "top", "bottom"});
}
void write_field_order(YAML::Emitter& out, const V4l2CameraSettings& s) { out << s.field_order; }
void read_standard(const ConfigNode& node, const char* key, V4l2CameraSettings& s) {
  s.standard = node.choice(key, {"PAL", "NTSC", "SECAM"});
}
void read_controls(const ConfigNode& node, const char* key, V4l2CameraSettings& s) {
  const ConfigNode controls = node.child(key);
  for (const std::string& name : controls.keys()) s.controls.push_back({name, controls.integer(name)});
}

using V4l2 = V4l2CameraSettings;
const Setting<V4l2> kV4l2Rows[] = {
    {"device", &V4l2::device, "/dev/video0, or a name of /dev/v4l/by-id, which survives another port", Need::kRequired},
    {"width_px", &V4l2::width, kSide_px, "0: as the device stands; a scan takes it from the rig's camera"},
    {"height_px", &V4l2::height, kSide_px, "likewise; a size that the device does not give is an error"},
    {"rate_hz", &V4l2::rate_hz, ConfigRange(0.1, 1000), "likewise; a rate that it does not give is a warning"},
    {"pixel_format",
     {read_formats, write_formats, "auto, GREY, Y16, YUYV, UYVY, BGR24, RGB24, RGGB, GRBG, GBRG, BGGR, MJPEG"},
     "auto: the first offered at the asked size and rate. One channel: GREY Y16 YUYV UYVY Bayer BGR24 RGB24 MJPEG; "
     "three: BGR24 RGB24 Bayer YUYV UYVY MJPEG GREY Y16"},
    {"field_order",
     {read_field_order, write_field_order,
      "any, none, interlaced, interlaced-tb, interlaced-bt, seq-tb, seq-bt, alternate, top, bottom"},
     "asked of the device"},
    {"fields", &V4l2::fields, "what becomes of an interlaced camera's two fields ([v4l2.md](v4l2.md))"},
    {"input", &V4l2::input, ConfigRange(0, 31), "of a frame grabber; none: as the device stands"},
    {"standard", {read_standard, nullptr, "PAL, NTSC, SECAM"}, "likewise"},
    {"controls",
     {read_controls, nullptr, "whole numbers by name"},
     "names of `v4l2-ctl -L` (those before kernel 5.17 too: `exposure_auto`, now `auto_exposure`) or ids "
     "(`0x009a0902`)"},
    {"keep_automatics", &V4l2::keep_automatics,
     "false: automatic exposure, gain, white balance, focus, hue, brightness are switched off; exposure may not change "
     "the rate"},
    {"exposure_s",
     &V4l2::exposure,
     {1e-6, 10},
     "none: the exposure control; absent there too, half a period is assumed; sigma and a warning say so"},
    {"readout_s", &V4l2::readout, kUpToASecond, "from the end of the exposure to the driver's end-of-frame stamp"},
    {"rolling_shutter", &V4l2::rolling_shutter,
     "rows are exposed one after the other over `readout_s`; the stamp is the middle row's"},
    {"stamp_clock", &V4l2::stamp_clock,
     "monotonic vouches for a driver that declares no clock (v4l2loopback); arrival uses no driver's stamp"},
    {"stamp_point", &V4l2::stamp_point, "end or start, against the driver's word"},
    {"stamp_sigma_s", &V4l2::stamp_sigma, kUpToASecond, "of a driver's stamp: interrupt latency"},
    {"buffers", &V4l2::buffers, ConfigRange(2, 32), "pictures that wait in the kernel"},
    {"timeout_s", &V4l2::timeout, kWait, "without a picture: stalled"},
    {"retry_s", &V4l2::retry, kWait, "between two looks for a lost camera"},
};

void check_v4l2(const ConfigNode& node, const V4l2& s) {
  if ((s.width == 0) != (s.height == 0))
    node.fail(s.width == 0 ? "height_px" : "width_px", "expected width_px and height_px together");
}

}  // namespace

constinit const SettingsTable<V4l2CameraSettings> kV4l2Keys{kV4l2Rows, check_v4l2};

std::vector<PixelFormat> preferred_formats(int channels) {
  using enum PixelFormat;
  if (channels == 1)
    return {kGrey, kGrey16, kYuyv, kUyvy, kBayerRggb8, kBayerGrbg8, kBayerGbrg8, kBayerBggr8, kBgr24, kRgb24, kMjpeg};
  return {kBgr24, kRgb24, kBayerRggb8, kBayerGrbg8, kBayerGbrg8, kBayerBggr8, kYuyv, kUyvy, kMjpeg, kGrey, kGrey16};
}

V4l2CameraSettings v4l2_settings_from(const ConfigNode& node, const std::string& name, int channels) {
  V4l2CameraSettings settings;
  settings.name = name;
  settings.channels = channels;
  read_settings(node, kV4l2Keys, settings);
  return settings;
}

}  // namespace tankrig
