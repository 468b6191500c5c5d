// The two fields of an interlaced picture: half its lines each, one field period apart.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

namespace tankrig {

/// Top holds rows 0, 2, 4 ... of the picture, bottom rows 1, 3, 5 ...
enum class Parity : std::uint8_t { kTop, kBottom };

/// How a buffer holds fields, and which of them was exposed first. Names and order as in the kernel's guide, "Field
/// Order".
enum class FieldLayout : std::uint8_t {
  kProgressive,
  kInterlacedTopFirst,  ///< rows in place
  kInterlacedBottomFirst,
  kSequentialTopFirst,     ///< all rows of the top field, then all of the bottom field
  kSequentialBottomFirst,  ///< all rows of the bottom field, then all of the top field
  kTop,                    ///< one field alone
  kBottom,
};

/// Which field of a picture in `layout` is the older one (of a lone field, itself).
Parity first_field(FieldLayout layout) noexcept;
constexpr Parity other(Parity parity) noexcept { return parity == Parity::kTop ? Parity::kBottom : Parity::kTop; }
constexpr bool is_lone_field(FieldLayout layout) noexcept {
  return layout == FieldLayout::kTop || layout == FieldLayout::kBottom;
}

/// The lines of one field, a view into `picture`; `picture` has two fields and an even number of rows.
cv::Mat field_lines(const cv::Mat& picture, FieldLayout layout, Parity parity);

/// A field at the picture's full size: its own rows in place, and between them the mean of their neighbours (at the
/// edge, the neighbour). Row y is scene row y, so the camera model holds.
cv::Mat full_height(const cv::Mat& lines, Parity parity);

/// Both fields in one picture, rows in place.
cv::Mat woven(const cv::Mat& top, const cv::Mat& bottom);

}  // namespace tankrig
