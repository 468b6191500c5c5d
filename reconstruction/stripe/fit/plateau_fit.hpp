// A clipped profile: a Gauss whose core is wider than what the pixels can show, fitted to both of its flanks.
#pragma once

#include <vector>

#include "reconstruction/stripe/find/clipped_runs.hpp"
#include "reconstruction/stripe/fit/profile_fit.hpp"

namespace tankrig {

/// Narrower plateaus (pixels) are left to the ordinary fit, whose weights spread over the core as well.
inline constexpr int kWidePlateau = 5;

struct PlateauFit {
  ProfileFit profile;         ///< amplitude: of the plateau over its background; the skewness is not measured
  double half_height_px = 0;  ///< full width at half of the plateau's height
  double sd_px = 0;           ///< of the Gauss
};

/// Censored least squares: background + height * exp(k * (e^2 - (x - centre)^2)) with e, k, centre and background free;
/// a clipped value is a lower bound. Not ok where a flank is missing or the two are not mirror images.
/// `core`: the values that are clipped; `noise`: sd of a value; `sloped`: the background is a line instead of a constant.
/// `reflectance`: of the surface at each value, 1 at most, where it changes; all light is in proportion to it.
PlateauFit fit_plateau(const std::vector<float>& values, const ClippedRun& core, double noise, bool sloped,
                       const float* reflectance = nullptr);

}  // namespace tankrig
