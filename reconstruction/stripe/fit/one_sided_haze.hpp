// Haze on one side of the stripe: light that water scatters out of a beam seen from aside. It draws every fit to that side.
#pragma once

#include <vector>

#include "reconstruction/stripe/fit/section_fits.hpp"

namespace tankrig {

/// A point and its fit, in rows of the image.
struct FittedPoint {
  PathPoint point;
  ProfileFit fit;
};

/// To be added to all positions of an image [px].
struct SharedShift {
  double px = 0, sigma_px = 0;
};

/// By the mean of many profiles, which shows the haze that no single one does. 0 where both sides are alike, or haze does
/// not explain what they differ by. `skewness`: typical of the points.
SharedShift measure_haze(SectionFits& sections, const std::vector<std::vector<FittedPoint>>& runs, double skewness);

}  // namespace tankrig
