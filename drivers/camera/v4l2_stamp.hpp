// From a driver's stamp to the middle of the exposure.
#pragma once

#include <optional>

#include "core/time.hpp"
#include "drivers/camera/v4l2_settings.hpp"

namespace tankrig {

/// A buffer's times, from the driver and the host.
struct V4l2BufferTimes {
  Stamp stamp{};           ///< the driver's; only meaningful if `monotonic`
  bool monotonic = false;  ///< declared to be on CLOCK_MONOTONIC (or the settings say so)
  bool at_start = false;   ///< taken when the exposure began; else when the last byte came
  Stamp arrived_after{};   ///< the last look that found nothing
  Stamp arrived_before{};  ///< the look that found the buffer
};

/// How the camera exposes.
struct V4l2Exposure {
  std::optional<Duration> time;
  Duration readout{};
  bool rolling_shutter = false;
  Duration period{};  ///< frame period; 0: unknown
  Duration stamp_sigma{};
};

struct MidExposure {
  Stamp stamp{};
  Duration sigma{};
  Duration exposure{};  ///< 0 if unknown
};

/// For a picture exposed at once, or the middle row of a rolling shutter:
///   stamped at the start:  mid = stamp + exposure / 2              (rolling: + readout / 2)
///   stamped at the end:    mid = stamp - readout - exposure / 2    (rolling: - readout / 2 - exposure / 2)
/// An unknown exposure counts as half the period, with a uniform error. A stamp on no known clock is replaced by the
/// middle of the interval in which the buffer arrived, at the end of the frame; sigma is that interval over sqrt(12).
/// Sigma covers jitter and an unknown exposure, not a read-out time missing from the rig file.
MidExposure mid_exposure(const V4l2BufferTimes& times, const V4l2Exposure& exposure) noexcept;

/// The two fields of one buffer are half a frame period apart; this is the older or the newer one's.
/// Stamped at the start: the older field's start; at the end: the newer field's end.
MidExposure field_mid_exposure(const MidExposure& buffer, bool older, bool at_start, Duration frame_period) noexcept;

/// Of both fields woven into one picture: the mean, each row off by a quarter of the frame period.
MidExposure woven_mid_exposure(const MidExposure& buffer, bool at_start, Duration frame_period) noexcept;

}  // namespace tankrig
