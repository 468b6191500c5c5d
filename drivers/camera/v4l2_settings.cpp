#include "drivers/camera/v4l2_settings.hpp"

namespace tankrig {
namespace {

constexpr int kLargestSide_px = 1 << 14;

std::optional<Duration> optional_seconds(const ConfigNode& node, std::string_view key, ConfigRange range) {
  if (!node.has(key)) return std::nullopt;
  return from_seconds(node.number(key, range));
}

std::string choice_or(const ConfigNode& node, std::string_view key, const std::vector<std::string>& allowed) {
  return node.has(key) ? node.choice(key, allowed) : allowed.front();
}

std::vector<PixelFormat> formats_from(const ConfigNode& node) {
  std::vector<std::string> allowed{"auto"};
  for (const PixelFormat format : kPixelFormats) allowed.emplace_back(to_string(format));
  const std::string name = choice_or(node, "pixel_format", allowed);
  if (name == "auto") return {};
  return {*pixel_format_from(name)};
}

FieldUse field_use_from(const ConfigNode& node) {
  const std::string name = choice_or(node, "fields", {"weave", "first", "second", "both"});
  if (name == "first") return FieldUse::kFirst;
  if (name == "second") return FieldUse::kSecond;
  return name == "both" ? FieldUse::kBoth : FieldUse::kWeave;
}

StampClock stamp_clock_from(const ConfigNode& node) {
  const std::string name = choice_or(node, "stamp_clock", {"declared", "monotonic", "arrival"});
  if (name == "monotonic") return StampClock::kMonotonic;
  return name == "arrival" ? StampClock::kArrival : StampClock::kDeclared;
}

StampPoint stamp_point_from(const ConfigNode& node) {
  const std::string name = choice_or(node, "stamp_point", {"declared", "end", "start"});
  if (name == "end") return StampPoint::kEnd;
  return name == "start" ? StampPoint::kStart : StampPoint::kDeclared;
}

}  // namespace

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
  settings.device = node.text("device");
  settings.width = node.integer_or("width_px", 0, {1, kLargestSide_px});
  settings.height = node.integer_or("height_px", 0, {1, kLargestSide_px});
  if ((settings.width == 0) != (settings.height == 0))
    node.fail(settings.width == 0 ? "height_px" : "width_px", "expected width_px and height_px together");
  settings.rate_hz = node.number_or("rate_hz", 0, {0.1, 1000});
  settings.formats = formats_from(node);
  settings.field_order = choice_or(node, "field_order",
                                   {"any", "none", "interlaced", "interlaced-tb", "interlaced-bt", "seq-tb", "seq-bt",
                                    "alternate", "top", "bottom"});
  settings.fields = field_use_from(node);
  if (node.has("input")) settings.input = node.integer("input", {0, 31});
  if (node.has("standard")) settings.standard = node.choice("standard", {"PAL", "NTSC", "SECAM"});
  if (const auto controls = node.optional_child("controls"))
    for (const std::string& key : controls->keys())
      settings.controls.push_back({key, controls->integer(key, {-2147483648.0, 2147483647.0})});
  settings.keep_automatics = node.flag_or("keep_automatics", false);
  settings.exposure = optional_seconds(node, "exposure_s", {1e-6, 10});
  settings.readout = optional_seconds(node, "readout_s", {0, 1}).value_or(settings.readout);
  settings.rolling_shutter = node.flag_or("rolling_shutter", false);
  settings.stamp_clock = stamp_clock_from(node);
  settings.stamp_point = stamp_point_from(node);
  settings.stamp_sigma = optional_seconds(node, "stamp_sigma_s", {0, 1}).value_or(settings.stamp_sigma);
  settings.buffers = node.integer_or("buffers", settings.buffers, {2, 32});
  settings.timeout = optional_seconds(node, "timeout_s", {0.01, 60}).value_or(settings.timeout);
  settings.retry = optional_seconds(node, "retry_s", {0.01, 60}).value_or(settings.retry);
  return settings;
}

}  // namespace tankrig
