// A clipped profile: a Gauss whose core is wider than what the pixels can show, fitted to both of its flanks.
#pragma once

#include <cstdint>
#include <vector>

#include "reconstruction/stripe/profile_fit.hpp"

namespace tankrig {

/// A run of clipped pixels: indices [first, last], none if last < first.
struct Plateau {
  int first = 0, last = -1;
  int width() const { return last - first + 1; }
};

/// Narrower plateaus (pixels) are left to the ordinary fit, whose weights spread over the core as well.
inline constexpr int kWidePlateau = 5;

/// The widest run of set flags that begins or ends within `reach` of `near` or holds it.
Plateau plateau_at(const std::vector<std::uint8_t>& clipped, int near, int reach);

struct PlateauFit {
  ProfileFit profile;         ///< amplitude: of the plateau over its background; the skewness is not measured
  double half_height_px = 0;  ///< full width at half of the plateau's height
  double sd_px = 0;           ///< of the Gauss
};

/// Censored least squares: background + height * exp(k * (e^2 - (x - centre)^2)) with e, k, centre and background free;
/// a clipped value is a lower bound. Not ok where a flank is missing or the two are not mirror images.
/// `clipped` flags `values`; `noise`: sd of a value; `sloped`: the background is a line instead of a constant.
PlateauFit fit_plateau(const std::vector<float>& values, const std::vector<std::uint8_t>& clipped,
                       const Plateau& plateau, double noise, bool sloped);

}  // namespace tankrig
