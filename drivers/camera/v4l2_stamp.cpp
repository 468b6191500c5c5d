#include "drivers/camera/v4l2_stamp.hpp"

#include <algorithm>
#include <cmath>

namespace tankrig {
namespace {

/// Standard deviation of something uniform over `width`.
double uniform(Duration width) { return static_cast<double>(width.count()) / std::sqrt(12.0); }

Duration together(double a, double b) { return Duration{static_cast<std::int64_t>(std::hypot(a, b) + 0.5)}; }

}  // namespace

MidExposure mid_exposure(const V4l2BufferTimes& times, const V4l2Exposure& exposure) noexcept {
  MidExposure mid;
  double sigma = static_cast<double>(exposure.stamp_sigma.count());
  const bool at_start = times.monotonic && times.at_start;
  if (times.monotonic) {
    mid.stamp = times.stamp;
  } else {
    const Duration open = std::max(times.arrived_before - times.arrived_after, Duration{0});
    mid.stamp = times.arrived_before - open / 2;
    sigma = std::hypot(sigma, uniform(open));
  }
  // Half the exposure lies between the stamp and the middle; unknown, it is uniform over half a period.
  const Duration half = exposure.time ? *exposure.time / 2 : exposure.period / 4;
  mid.exposure = exposure.time.value_or(Duration{0});
  mid.sigma = together(sigma, exposure.time ? 0 : uniform(exposure.period / 2));
  if (at_start)
    mid.stamp = mid.stamp + half + (exposure.rolling_shutter ? exposure.readout / 2 : Duration{0});
  else
    mid.stamp = mid.stamp - half - (exposure.rolling_shutter ? exposure.readout / 2 : exposure.readout);
  return mid;
}

MidExposure field_mid_exposure(const MidExposure& buffer, bool older, bool at_start, Duration frame_period) noexcept {
  MidExposure mid = buffer;
  if (at_start && !older) mid.stamp = mid.stamp + frame_period / 2;
  if (!at_start && older) mid.stamp = mid.stamp - frame_period / 2;
  return mid;
}

MidExposure woven_mid_exposure(const MidExposure& buffer, bool at_start, Duration frame_period) noexcept {
  MidExposure mid = buffer;
  mid.stamp = at_start ? mid.stamp + frame_period / 4 : mid.stamp - frame_period / 4;
  mid.sigma = together(static_cast<double>(buffer.sigma.count()), static_cast<double>(frame_period.count()) / 4);
  return mid;
}

}  // namespace tankrig
