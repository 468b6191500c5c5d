// A Gaussian profile on a straight background, fitted across the stripe.
#pragma once

#include <span>
#include <utility>
#include <vector>

namespace tankrig {

/// Weight of the noise expected beforehand against the residuals, in degrees of freedom.
inline constexpr double kPriorFreedom = 8;

/// What scatters a value about the profile: variance additive^2 + (contrast * light of the stripe)^2.
/// Units: `additive` as the values, `contrast` a fraction: that of the speckle, where a laser's light is rough.
struct ValueNoise {
  double additive = 0;
  double contrast = 0;
};

/// Values across the stripe, and where the fit starts, in their index.
struct ProfileSection {
  const float* values = nullptr;
  int count = 0;
  double start = 0;
  /// Of the surface at each value, any scale, none negative, where it changes: the light is the Gauss times it, and the
  /// background in proportion to it. Width and skewness are not measured then.
  const float* reflectance = nullptr;
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
  double misfit = 0;      ///< mean squared residual over what the noise lets expect
  int freedom = 0;        ///< degrees of freedom of `misfit`
  double edge_sigma = 0;  ///< what `sigma` holds for the unknown place of an edge: neighbours share it [px]
};

/// Of the fitted profiles: their sd [px], and what depends on it alone.
struct ProfileShape {
  double sd, decay;  ///< the Gauss's ratio from one pixel to the next falls by `decay`
  bool sloped;
  int half_window;
  double width_on_core, width_on_constant, width_power;  ///< second-order shape, made orthogonal to the model
  double skew_on_shift, skew_on_slope, skew_power;       ///< third-order shape, likewise
};

/// Least squares with a fixed width; the position then by least squares weighted with the noise of each value.
/// Threads: const and safe.
class ProfileFitter {
 public:
  /// `sd` of the profile [px]; `sloped`: the background is a line instead of a constant.
  ProfileFitter(double sd, bool sloped);

  double sd() const { return shape_.sd; }

  /// Half of the window, in whole pixels.
  int half_window() const { return shape_.half_window; }

  /// First and last of the values that a fit of values[0, count) from `start` on looks at.
  std::pair<int, int> window(int count, double start) const;

  /// `noise` is balanced against the residuals.
  ProfileFit fit(const ProfileSection& section, const ValueNoise& noise) const;

  /// The same of each section, faster.
  std::vector<ProfileFit> fit(std::span<const ProfileSection> sections, const ValueNoise& noise) const;

 private:
  ProfileShape shape_;
};

}  // namespace tankrig
