#include "drivers/camera/v4l2_format.hpp"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

struct FieldName {
  const char* name;
  std::uint32_t field;
};

constexpr std::array kFieldNames{FieldName{"any", V4L2_FIELD_ANY},
                                 FieldName{"none", V4L2_FIELD_NONE},
                                 FieldName{"interlaced", V4L2_FIELD_INTERLACED},
                                 FieldName{"interlaced-tb", V4L2_FIELD_INTERLACED_TB},
                                 FieldName{"interlaced-bt", V4L2_FIELD_INTERLACED_BT},
                                 FieldName{"seq-tb", V4L2_FIELD_SEQ_TB},
                                 FieldName{"seq-bt", V4L2_FIELD_SEQ_BT},
                                 FieldName{"alternate", V4L2_FIELD_ALTERNATE},
                                 FieldName{"top", V4L2_FIELD_TOP},
                                 FieldName{"bottom", V4L2_FIELD_BOTTOM}};

std::uint32_t field_named(const std::string& name) {
  for (const FieldName& row : kFieldNames)
    if (name == row.name) return row.field;
  return V4L2_FIELD_ANY;
}

std::string video_nodes() {
  std::string names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", error))
    if (const std::string name = entry.path().filename().string(); name.starts_with("video"))
      names += (names.empty() ? "" : " ") + entry.path().string();
  return names.empty() ? "this machine has none" : "there are: " + names;
}

std::string what_to_do(int problem) {
  switch (problem) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
      return "no such camera: plug it in, or name another (" + video_nodes() + ")";
    case EACCES:
    case EPERM:
      return "no permission: sudo usermod -aG video $USER, then log in again";
    case EBUSY:
      return "in use by another program: close it (fuser -v DEVICE names it)";
    case ENOTTY:
      return "not a video device: name a capture device (" + video_nodes() + ")";
    default:
      return std::string("cannot be opened: ") + std::strerror(problem);
  }
}

/// One conversation with an open device.
class Negotiation {
 public:
  Negotiation(V4l2Device& device, const V4l2CameraSettings& settings, std::vector<std::string>& warnings)
      : device_(device), settings_(settings), warnings_(warnings) {}

  V4l2Format run() {
    check_capabilities();
    choose_input();
    list_formats();
    return choose_format();
  }

 private:
  [[noreturn]] void fail(const std::string& message) const {
    throw InputError(settings_.name + ": " + settings_.device + ": " + message);
  }

  void check_capabilities() {
    v4l2_capability capability{};
    if (const int problem = device_.call(VIDIOC_QUERYCAP, &capability); problem != 0)
      fail(what_to_do(problem == EINVAL ? ENOTTY : problem));
    const auto* card = reinterpret_cast<const char*>(capability.card);
    card_.assign(card, ::strnlen(card, sizeof capability.card));
    const std::uint32_t can =
        capability.capabilities & V4L2_CAP_DEVICE_CAPS ? capability.device_caps : capability.capabilities;
    if (!(can & V4L2_CAP_VIDEO_CAPTURE)) {
      if (can & V4L2_CAP_VIDEO_CAPTURE_MPLANE)
        fail("'" + card_ + "' has multi-planar capture only, expected a camera with single-planar capture");
      if (can & V4L2_CAP_VIDEO_OUTPUT)
        fail("'" + card_ + "' is an output device: a loopback captures only after its writer has begun");
      fail("'" + card_ + "' does not capture video: cameras often have a second node for metadata, try the one before");
    }
    if (!(can & V4L2_CAP_STREAMING)) fail("'" + card_ + "' cannot stream to memory (mmap), expected a camera that can");
  }

  void choose_input() {
    if (settings_.input) {
      int input = *settings_.input;
      if (const int problem = device_.call(VIDIOC_S_INPUT, &input); problem != 0)
        fail(fmt::format("input: found {}, and the device refuses it ({})", *settings_.input, std::strerror(problem)));
    }
    v4l2_std_id standard = settings_.standard == "PAL"     ? V4L2_STD_PAL
                           : settings_.standard == "NTSC"  ? V4L2_STD_NTSC
                           : settings_.standard == "SECAM" ? V4L2_STD_SECAM
                                                           : 0;
    if (standard != 0)
      if (const int problem = device_.call(VIDIOC_S_STD, &standard); problem != 0)
        fail("standard: the device refuses " + settings_.standard + " (" + std::strerror(problem) +
             "), expected an analogue input");
    if (device_.call(VIDIOC_G_STD, &standard) != 0 || standard == 0) return;
    // 525-line systems send the bottom field first, 625-line ones the top field.
    top_first_ = !(standard & V4L2_STD_525_60);
    standard_hz_ = top_first_ ? 25 : 30000 / 1001.0;
  }

  void list_formats() {
    v4l2_fmtdesc description{};
    description.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    while (device_.call(VIDIOC_ENUM_FMT, &description) == 0) {
      offered_.push_back(description.pixelformat);
      const std::uint32_t next = description.index + 1;
      description = {};
      description.index = next;
      description.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    }
  }

  bool offers(std::uint32_t fourcc) const {
    for (const std::uint32_t one : offered_)
      if (one == fourcc) return true;
    return false;
  }

  /// The four-character code under which the device knows it; 0 if it does not.
  std::uint32_t offered_code(PixelFormat pixel) const {
    if (offers(fourcc_of(pixel))) return fourcc_of(pixel);
    return pixel == PixelFormat::kMjpeg && offers(V4L2_PIX_FMT_JPEG) ? V4L2_PIX_FMT_JPEG : 0;
  }

  V4l2Format choose_format() {
    const auto wanted = settings_.formats.empty() ? preferred_formats(settings_.channels) : settings_.formats;
    std::string tried;
    std::optional<V4l2Format> slow;
    PixelFormat last{};
    for (const PixelFormat pixel : wanted) {
      const std::uint32_t code = offered_code(pixel);
      if (code == 0) continue;
      const V4l2Format got = try_format(pixel, code, tried);
      if (got.width == 0) continue;
      last = pixel;
      if (reaches_rate(got)) return finished(got);
      if (!slow) slow = got;
    }
    if (!slow) fail_to_agree(wanted, tried);
    if (slow->pixel != last) slow = try_format(slow->pixel, offered_code(slow->pixel), tried);
    warnings_.push_back(fmt::format("rate: asked for {:g} Hz, the device gives {:g} Hz in {}", settings_.rate_hz,
                                    slow->rate_hz, to_string(slow->pixel)));
    return finished(*slow);
  }

  bool reaches_rate(const V4l2Format& format) const {
    return settings_.rate_hz <= 0 || format.rate_hz <= 0 || std::abs(format.rate_hz / settings_.rate_hz - 1) < 0.02;
  }

  /// Width 0 if the device would not; then `tried` says what it gave instead.
  V4l2Format try_format(PixelFormat pixel, std::uint32_t code, std::string& tried) {
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (const int problem = device_.call(VIDIOC_G_FMT, &format); problem == EBUSY || problem == ENODEV)
      fail(what_to_do(problem));
    v4l2_pix_format& pix = format.fmt.pix;
    if (settings_.width > 0) pix.width = static_cast<std::uint32_t>(settings_.width);
    const std::uint32_t field = field_named(settings_.field_order);
    const bool lone = field == V4L2_FIELD_ALTERNATE || field == V4L2_FIELD_TOP || field == V4L2_FIELD_BOTTOM;
    if (settings_.height > 0) pix.height = static_cast<std::uint32_t>(lone ? settings_.height / 2 : settings_.height);
    pix.pixelformat = code;
    pix.field = field;
    pix.bytesperline = pix.sizeimage = 0;
    if (const int problem = device_.call(VIDIOC_S_FMT, &format); problem != 0) {
      if (problem == EBUSY || problem == ENODEV) fail(what_to_do(problem));
      tried += std::string(tried.empty() ? "" : ", ") + to_string(pixel) + " refused (" + std::strerror(problem) + ")";
      return {};
    }
    V4l2Format got = agreed(pixel, pix);
    const bool sized = (settings_.width == 0 || got.width == settings_.width) &&
                       (settings_.height == 0 || got.picture_height() == settings_.height);
    const bool fielded = field == V4L2_FIELD_ANY || pix.field == field;
    if (pix.pixelformat != code || !sized || !fielded) {
      tried += fmt::format("{}{} {}x{} field order {}", tried.empty() ? "" : ", ", fourcc_text(pix.pixelformat),
                           got.width, got.picture_height(), field_order_name(pix.field));
      return {};
    }
    got.rate_hz = negotiate_rate();
    if (got.rate_hz <= 0) got.rate_hz = standard_hz_;
    return got;
  }

  V4l2Format agreed(PixelFormat pixel, const v4l2_pix_format& pix) {
    V4l2Format got;
    got.pixel = pixel;
    got.width = static_cast<int>(pix.width);
    got.height = static_cast<int>(pix.height);
    got.stride =
        pixel == PixelFormat::kMjpeg ? 0 : std::max<std::size_t>(pix.bytesperline, row_bytes(pixel, got.width));
    got.field = pix.field;
    got.top_first = top_first_;
    got.card = card_;
    got.full_range = pix.quantization == V4L2_QUANTIZATION_FULL_RANGE ||
                     (pix.quantization == V4L2_QUANTIZATION_DEFAULT && pix.colorspace == V4L2_COLORSPACE_JPEG);
    encoding_ = pix.ycbcr_enc;
    if (encoding_ == V4L2_YCBCR_ENC_DEFAULT)
      encoding_ = static_cast<std::uint32_t>(V4L2_MAP_YCBCR_ENC_DEFAULT(pix.colorspace));
    return got;
  }

  double negotiate_rate() {
    v4l2_streamparm parameters{};
    parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (device_.call(VIDIOC_G_PARM, &parameters) != 0) return 0;
    if (settings_.rate_hz > 0 && parameters.parm.capture.capability & V4L2_CAP_TIMEPERFRAME) {
      parameters.parm.capture.timeperframe = {1000, static_cast<std::uint32_t>(std::lround(settings_.rate_hz * 1000))};
      if (device_.call(VIDIOC_S_PARM, &parameters) != 0) return 0;
    }
    const v4l2_fract period = parameters.parm.capture.timeperframe;
    return period.numerator > 0 ? static_cast<double>(period.denominator) / period.numerator : 0;
  }

  V4l2Format finished(const V4l2Format& format) {
    const bool yuv = format.pixel == PixelFormat::kYuyv || format.pixel == PixelFormat::kUyvy;
    if (yuv && settings_.channels == 3 && encoding_ != V4L2_YCBCR_ENC_601 && encoding_ != V4L2_YCBCR_ENC_XV601)
      warnings_.push_back("the device codes its colours by another matrix than ITU-R BT.601: hues are a little off");
    return format;
  }

  [[noreturn]] void fail_to_agree(const std::vector<PixelFormat>& wanted, const std::string& tried) const {
    if (!tried.empty())
      fail(fmt::format("asked for {}x{} field order {}, the device gives: {} (v4l2-ctl -d DEVICE --list-formats-ext)",
                       settings_.width, settings_.height, settings_.field_order, tried));
    std::string asked, offered;
    for (const PixelFormat pixel : wanted) asked += (asked.empty() ? "" : " ") + std::string(to_string(pixel));
    for (const std::uint32_t code : offered_) {
      const auto known = pixel_format_from_fourcc(code);
      offered +=
          (offered.empty() ? "" : " ") + (known ? std::string(to_string(*known)) : "'" + fourcc_text(code) + "'");
    }
    fail("pixel_format: found " + asked + ", the device offers: " + (offered.empty() ? "none" : offered));
  }

  V4l2Device& device_;
  const V4l2CameraSettings& settings_;
  std::vector<std::string>& warnings_;
  std::string card_;
  std::vector<std::uint32_t> offered_;
  bool top_first_ = true;
  double standard_hz_ = 0;  ///< frames; 0: no analogue standard
  std::uint32_t encoding_ = V4L2_YCBCR_ENC_601;
};

}  // namespace

bool V4l2Format::lone_fields() const {
  return field == V4L2_FIELD_ALTERNATE || field == V4L2_FIELD_TOP || field == V4L2_FIELD_BOTTOM;
}

std::string field_order_name(std::uint32_t field) {
  for (const FieldName& row : kFieldNames)
    if (field == row.field) return row.name;
  return std::to_string(field);
}

FieldLayout field_layout(std::uint32_t field, bool top_first) noexcept {
  switch (field) {
    case V4L2_FIELD_TOP:
      return FieldLayout::kTop;
    case V4L2_FIELD_BOTTOM:
      return FieldLayout::kBottom;
    case V4L2_FIELD_INTERLACED:
      return top_first ? FieldLayout::kInterlacedTopFirst : FieldLayout::kInterlacedBottomFirst;
    case V4L2_FIELD_INTERLACED_TB:
      return FieldLayout::kInterlacedTopFirst;
    case V4L2_FIELD_INTERLACED_BT:
      return FieldLayout::kInterlacedBottomFirst;
    case V4L2_FIELD_SEQ_TB:
      return FieldLayout::kSequentialTopFirst;
    case V4L2_FIELD_SEQ_BT:
      return FieldLayout::kSequentialBottomFirst;
    default:
      return FieldLayout::kProgressive;
  }
}

V4l2Format open_v4l2(V4l2Device& device, const V4l2CameraSettings& settings, std::vector<std::string>& warnings) {
  if (const int problem = device.open(settings.device); problem != 0)
    throw InputError(settings.name + ": " + settings.device + ": " + what_to_do(problem));
  return Negotiation(device, settings, warnings).run();
}

}  // namespace tankrig
