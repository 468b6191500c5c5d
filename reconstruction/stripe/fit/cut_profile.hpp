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

/// What dark and bright parts of the scene show of its light, and of the laser's [the values' units].
struct SurfaceLight {
  double scene, laser;
};

/// The share of the bright parts' light that all parts show beside what goes with their reflectance to the laser: glare, or
/// dark parts that are darker still in the laser's colour. Negative where they are brighter in it; 0 where the samples hold
/// too few of either.
double veil_of(const std::vector<SurfaceLight>& samples, double noise);

/// Of the surface at each row, at most 1, by the light that is not the laser's, without the veil. False where no edge divides
/// the section, where the image cannot tell, a grey one without a dark one, and of a clipped section with a dark one: what its
/// flanks lie on is gone, and behind an edge of the scene there is mostly another depth.
bool measure_reflectance(const cv::Mat& image, const cv::Mat& background, const StripeAppearance& appearance,
                         const SectionRows& rows, double veil, std::vector<float>& reflectance);

/// Of fits to the same values without an edge and with one, the likelier. Its sigma holds how far the other is, as far as chance does not
/// tell them apart.
ProfileFit likelier(const ProfileFit& whole, const ProfileFit& cut);

/// As many reach two sd and more into the dark.
inline constexpr int kStartsInTheDark = 3;

/// A section with reflectance, whose middle may lie on the dark side, far from where the light is brightest: the best of
/// `starts` there. The sigma holds what the edge's own place, known to a quarter of a pixel, leaves open.
ProfileFit fit_cut(const ProfileFitter& fitter, const ProfileSection& section, const ValueNoise& noise, int starts);

/// Of values that an edge divides which nothing else shows: the likeliest of all edges, and of none. Empty: the values' ends
/// do not differ.
std::optional<ProfileFit> fit_unseen_edge(const ProfileFitter& fitter, const std::vector<float>& values, double start,
                                          const ValueNoise& noise, double veil);

}  // namespace tankrig
