// Whether a pixel lies in a range of OpenCV's 8-bit HSV, without an HSV picture.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

namespace tankrig {

/// Both ends included.
struct ByteRange {
  int min = 0, max = 255;
  bool holds(int value) const { return value >= min && value <= max; }
};

/// The same verdict as cv::cvtColor with COLOR_BGR2HSV and cv::inRange, for every colour.
class HsvGate {
 public:
  HsvGate(ByteRange hue, ByteRange saturation, ByteRange value) : hue_(hue), saturation_(saturation), value_(value) {
    for (int i = 1; i < 256; ++i) {
      saturation_share_[i] = rounded_share(255 << kShift, i);
      hue_share_[i] = rounded_share(180 << kShift, 6 * i);
    }
  }

  /// `bgr`: three bytes.
  bool operator()(const std::uint8_t* bgr) const {
    const int b = bgr[0], g = bgr[1], r = bgr[2];
    const int v = std::max({b, g, r}), range = v - std::min({b, g, r});
    if (!value_.holds(v) || !saturation_.holds(scaled(range, saturation_share_[v]))) return false;
    const int sector = v == r ? g - b : v == g ? b - r + 2 * range : r - g + 4 * range;
    const int h = scaled(sector, hue_share_[range]);
    return hue_.holds(h < 0 ? h + 180 : h);
  }

 private:
  static constexpr int kShift = 12;
  /// To the nearest whole number; of two as near, the even one.
  static int rounded_share(int whole, int parts) {
    const int low = whole / parts, twice_rest = 2 * (whole % parts);
    return low + (twice_rest > parts || (twice_rest == parts && low % 2 != 0));
  }
  static int scaled(int value, int share) { return (value * share + (1 << (kShift - 1))) >> kShift; }

  ByteRange hue_, saturation_, value_;
  std::array<int, 256> saturation_share_{}, hue_share_{};
};

}  // namespace tankrig
