// The profile of a stripe that crosses an edge of the surface's brightness: of a board's square, of an object's rim.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "reconstruction/stripe/find/appearance.hpp"
#include "reconstruction/stripe/find/clipped_runs.hpp"
#include "reconstruction/stripe/fit/profile_fit.hpp"

namespace tankrig {

/// Whether one value's light is so much less than the other's that an edge of the scene lies between them.
bool differ_by_edge(double one, double other, double noise);

/// Rows [first, first + count) of a column, and those of its pixels that are clipped.
struct SectionRows {
  int column = 0, first = 0, count = 0;
  ClippedRun core;
};

/// The scene's light at a point of the stripe, and the laser's. Each in its own unit.
struct SurfaceLight {
  double scene, laser;
};

/// Light that dark parts show like bright ones, but not to the laser, over the bright parts': glare, or dark parts that are
/// darker still in the laser's colour. Negative where they are brighter in it. 0 where either kind has too few samples, and
/// where the dark parts are not dark to the laser.
double veil_of(const std::vector<SurfaceLight>& samples, double noise);

/// Of the surface at each row, about 1 on the bright side, by the light that is not the laser's, without the veil. False where no
/// edge divides the section (`reflectance` is that light), where the image cannot tell, a grey one without a dark one, and of a
/// clipped section with a dark one: what its flanks lie on is gone, and behind an edge of the scene is mostly another depth.
bool measure_reflectance(const cv::Mat& image, const cv::Mat& background, const StripeAppearance& appearance,
                         const SectionRows& rows, double veil, std::vector<float>& reflectance);

/// Of fits without and with an edge the likelier. Its sigma holds the distance to the other, weighted by the other's chance.
ProfileFit likelier(const ProfileFit& whole, const ProfileFit& cut);

/// As many reach two sd and more into the dark.
inline constexpr int kStartsInTheDark = 3;

/// A section with reflectance, whose middle may lie on the dark side, far from where the light is brightest: the best of
/// `starts` there. The sigma holds what the edge's own place, known to a quarter of a pixel, leaves open.
ProfileFit fit_cut(const ProfileFitter& fitter, const ProfileSection& section, const ValueNoise& noise, int starts);

/// Of values that an edge divides which nothing else shows: the likeliest of all edges and none. Empty: the values' ends
/// do not differ.
std::optional<ProfileFit> fit_unseen_edge(const ProfileFitter& fitter, const std::vector<float>& values, double start,
                                          const ValueNoise& noise, double veil);

}  // namespace tankrig
