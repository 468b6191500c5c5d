// Maps a device's clock to ours: a straight line through pairs of readings, with an honest sigma.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "core/time.hpp"

namespace tankrig {

/// One moment read on both clocks.
struct ClockSample {
  std::int64_t device_ns = 0;
  Stamp host{};
  Duration sigma{};  ///< one standard deviation of `host` at that moment
};

struct MappedStamp {
  Stamp stamp{};
  Duration sigma{};
};

struct ClockFitSettings {
  std::size_t window = 64;                    ///< samples kept
  Duration span = std::chrono::seconds(120);  ///< and no older than this
  double rate_prior_ppm = 100;                ///< how far an unknown oscillator may be off, one sigma
  double wander_ppm = 0.5;                    ///< how fast the line ages beyond its newest sample
  double outlier_sigmas = 5;
  Duration outlier_floor = std::chrono::microseconds(50);  ///< no sample nearer than this is an outlier
};

/// host = line(device), weighted least squares over a sliding window. The rate has a prior, so one sample already maps,
/// with a suitable sigma. A sample far off the line is put aside. If two in a row agree with each other and not with
/// the line, the clock was set or reset, and the fit starts again from them.
/// Threads: one.
class ClockFit {
 public:
  enum class Verdict { kAccepted, kOutlier, kJump };

  explicit ClockFit(const ClockFitSettings& settings = {}) : settings_(settings) {}

  Verdict add(const ClockSample& sample);
  /// Whether the current line explains the sample. False before the first one.
  bool agrees(const ClockSample& sample) const;
  /// Nothing before the first sample.
  std::optional<MappedStamp> map(std::int64_t device_ns) const;
  void reset();

  /// How much faster than ours the device's clock runs [ppm], and its one sigma.
  double drift_ppm() const { return -rate_error_ * 1e6; }
  double drift_sigma_ppm() const { return rate_sigma_ * 1e6; }
  std::size_t samples() const { return window_.size(); }
  std::uint64_t outliers() const { return outliers_; }
  std::uint64_t jumps() const { return jumps_; }

 private:
  void solve();

  ClockFitSettings settings_;
  std::deque<ClockSample> window_;
  std::optional<ClockSample> suspect_;  ///< put aside: noise, or the first of a new time
  std::uint64_t outliers_ = 0, jumps_ = 0;

  // host - host0 = offset + (1 + rate_error) * (device - device0), device0 at the weighted mean of the window
  std::int64_t device0_ = 0;
  Stamp host0_{};
  double offset_ns_ = 0, rate_error_ = 0;
  double offset_sigma_ns_ = 0, rate_sigma_ = 0;
  std::int64_t newest_ns_ = 0;
};

/// For a device whose clock cannot be read. Frames arrive after they were stamped, never before. So the earliest
/// arrivals of a period, minus the known transfer delay, are readings of both clocks.
/// Threads: one.
class ArrivalEnvelope {
 public:
  /// `frames` arrivals make one sample; `floor` is its least sigma.
  explicit ArrivalEnvelope(std::size_t frames = 25, Duration floor = std::chrono::microseconds(20))
      : frames_(frames), floor_(floor) {}

  /// `arrival`: when the frame came, minus the delay of every frame.
  std::optional<ClockSample> add(std::int64_t device_ns, Stamp arrival);
  void reset() { arrivals_.clear(); }

 private:
  std::size_t frames_;
  Duration floor_;
  std::vector<ClockSample> arrivals_;
};

}  // namespace tankrig
