// Opens a capture device and agrees with it on input, size, pixel format and rate.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/camera/field_split.hpp"
#include "drivers/camera/v4l2_device.hpp"
#include "drivers/camera/v4l2_settings.hpp"

namespace tankrig {

/// What was agreed.
struct V4l2Format {
  PixelFormat pixel = PixelFormat::kGrey;
  int width = 0, height = 0;  ///< [px] of a buffer; a lone field has half the picture's rows
  std::size_t stride = 0;     ///< [bytes]; 0 for a compressed format
  std::uint32_t field = 0;    ///< enum v4l2_field
  bool full_range = false;
  bool top_first = true;  ///< of fields whose order the buffer does not tell
  double rate_hz = 0;     ///< frames; 0: the device does not say
  std::string card;       ///< the device's own name

  bool lone_fields() const;
  int picture_height() const { return lone_fields() ? 2 * height : height; }
  friend bool operator==(const V4l2Format&, const V4l2Format&) = default;
};

/// The layout of a buffer whose field is `field` (of an agreed format or of one buffer of alternating fields).
FieldLayout field_layout(std::uint32_t field, bool top_first) noexcept;

/// As v4l2-ctl writes it without spaces: "none", "interlaced-tb", "alternate" ...
std::string field_order_name(std::uint32_t field);

/// Opens `settings.device`, checks that it captures and streams, and agrees on a format. Adds tolerable differences
/// from the request to `warnings`.
/// Errors: InputError, one line that says what to do.
V4l2Format open_v4l2(V4l2Device& device, const V4l2CameraSettings& settings, std::vector<std::string>& warnings);

}  // namespace tankrig
