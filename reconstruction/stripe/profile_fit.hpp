// A Gaussian profile on a straight background, fitted across the stripe.
#pragma once

namespace tankrig {

/// Units: pixels and the values' own unit.
struct ProfileFit {
  bool ok = false;
  double position = 0;  ///< centre, in the index of the values
  double sigma = 0;     ///< of the position [px]
  double amplitude = 0;
  double amplitude_sigma = 0;
  double width_ratio = 1;  ///< sd of the profile over the fitter's, to first order
  double width_sigma = 0;
  double skewness = 0;  ///< third standardised moment, to first order (Gram-Charlier)
  double skewness_sigma = 0;
};

/// Least squares with a fixed width.  Threads: const and safe.
class ProfileFitter {
 public:
  /// `sd` of the profile [px]; `sloped`: the background is a line instead of a constant.
  ProfileFitter(double sd, bool sloped);

  double sd() const { return sd_; }

  /// Half of the window, in whole pixels.
  int half_window() const { return half_window_; }

  /// Fits values[0, count) from `start` on; `noise` is the expected sd of a value, balanced against the residuals.
  ProfileFit fit(const float* values, int count, double start, double noise) const;

 private:
  struct LinearFit;
  LinearFit solve(const float* values, int first, int last, double centre) const;

  double sd_;
  bool sloped_;
  int half_window_;
  double width_on_core_, width_on_constant_, width_power_;  ///< second-order shape, made orthogonal to the model
  double skew_on_shift_, skew_on_slope_, skew_power_;       ///< third-order shape, likewise
};

}  // namespace tankrig
