#include "drivers/camera/field_split.hpp"

#include <cstring>

namespace tankrig {
namespace {

/// Rounded mean of two rows of bytes.
void mean_row(const std::uint8_t* a, const std::uint8_t* b, std::uint8_t* out, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) out[i] = static_cast<std::uint8_t>((a[i] + b[i] + 1) / 2);
}

/// Every second row of `picture` from `first` on.
cv::Mat every_second_row(const cv::Mat& picture, int first) {
  return {picture.rows / 2, picture.cols, picture.type(),
          picture.data + picture.step[0] * static_cast<std::size_t>(first), picture.step[0] * 2};
}

}  // namespace

Parity first_field(FieldLayout layout) noexcept {
  switch (layout) {
    case FieldLayout::kInterlacedBottomFirst:
    case FieldLayout::kSequentialBottomFirst:
    case FieldLayout::kBottom:
      return Parity::kBottom;
    default:
      return Parity::kTop;
  }
}

cv::Mat field_lines(const cv::Mat& picture, FieldLayout layout, Parity parity) {
  const int half = picture.rows / 2;
  switch (layout) {
    case FieldLayout::kSequentialTopFirst:
    case FieldLayout::kSequentialBottomFirst:
      return parity == first_field(layout) ? picture.rowRange(0, half) : picture.rowRange(half, 2 * half);
    case FieldLayout::kInterlacedTopFirst:
    case FieldLayout::kInterlacedBottomFirst:
      return every_second_row(picture, parity == Parity::kTop ? 0 : 1);
    default:
      return picture;
  }
}

cv::Mat full_height(const cv::Mat& lines, Parity parity) {
  cv::Mat out(lines.rows * 2, lines.cols, lines.type());
  const std::size_t size = static_cast<std::size_t>(lines.cols) * lines.elemSize();
  const int own = parity == Parity::kTop ? 0 : 1;
  const int last = lines.rows - 1;
  for (int k = 0; k <= last; ++k) {
    std::memcpy(out.ptr(2 * k + own), lines.ptr(k), size);
    // The row between lines k and k + 1; beyond the edge line k itself.
    const int above = parity == Parity::kTop ? k : k - 1;
    const int upper = above < 0 ? 0 : above, lower = above + 1 > last ? last : above + 1;
    mean_row(lines.ptr(upper), lines.ptr(lower), out.ptr(2 * k + 1 - own), size);
  }
  return out;
}

cv::Mat woven(const cv::Mat& top, const cv::Mat& bottom) {
  cv::Mat out(top.rows * 2, top.cols, top.type());
  const std::size_t size = static_cast<std::size_t>(top.cols) * top.elemSize();
  for (int k = 0; k < top.rows; ++k) {
    std::memcpy(out.ptr(2 * k), top.ptr(k), size);
    std::memcpy(out.ptr(2 * k + 1), bottom.ptr(k), size);
  }
  return out;
}

}  // namespace tankrig
