// A Gaussian profile on a straight background, fitted across the stripe.
#pragma once

#include <utility>

namespace tankrig {

/// What scatters a value about the profile: variance additive^2 + (contrast * light of the stripe)^2.
/// Units: `additive` as the values, `contrast` a fraction: that of the speckle, where a laser's light is rough.
struct ValueNoise {
  double additive = 0;
  double contrast = 0;
};

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
  double misfit = 0;  ///< mean squared residual over what the noise lets expect
};

/// Least squares with a fixed width; the position then by least squares weighted with the noise of each value.
/// Threads: const and safe.
class ProfileFitter {
 public:
  /// `sd` of the profile [px]; `sloped`: the background is a line instead of a constant.
  ProfileFitter(double sd, bool sloped);

  double sd() const { return sd_; }

  /// Half of the window, in whole pixels.
  int half_window() const { return half_window_; }

  /// First and last of the values that a fit of values[0, count) from `start` on looks at.
  std::pair<int, int> window(int count, double start) const;

  /// Fits values[0, count) from `start` on; `noise` is balanced against the residuals.
  ProfileFit fit(const float* values, int count, double start, const ValueNoise& noise) const;

  /// Likewise where the surface's reflectance changes across the stripe: the light is the Gauss times it, and the
  /// background in proportion to it. Width and skewness are not measured.
  /// `reflectance`: of each value, any scale, none negative.
  ProfileFit fit(const float* values, int count, double start, const ValueNoise& noise, const float* reflectance) const;

 private:
  struct Window;
  struct LinearFit;
  /// `contrast`: of the stripe's light, over the noise that is the same for all values.
  LinearFit solve(const Window& window, double centre, double contrast) const;
  double centre_from(const Window& window, double start, LinearFit& linear) const;
  void refine(const Window& window, const ValueNoise& noise, ProfileFit& result) const;

  double sd_, decay_;  ///< the Gauss's ratio from one pixel to the next falls by this
  bool sloped_;
  int half_window_;
  double width_on_core_, width_on_constant_, width_power_;  ///< second-order shape, made orthogonal to the model
  double skew_on_shift_, skew_on_slope_, skew_power_;       ///< third-order shape, likewise
};

}  // namespace tankrig
