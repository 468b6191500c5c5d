#include "reconstruction/stripe/fit/cut_profile.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tankrig {
namespace {

constexpr float kDarkest = 0.03f;  ///< of the reflectance over its largest

/// Parts of the section that its ends are. What is beside the profile changes its fit only while it is in the values: a dark
/// image takes it away.
constexpr int kAnywhere = 6, kThroughProfile = 3;

struct Ends {
  float first, last;
  float top() const { return std::max(first, last); }
};

/// Means of the first and the last `part`th, where an edge lies between them.
std::optional<Ends> ends_at_edge(const std::vector<float>& light, int part, double noise) {
  const auto n = std::max<std::ptrdiff_t>(2, std::ssize(light) / part);
  if (std::ssize(light) < 2 * n) return std::nullopt;
  const auto mean = [&](auto from) { return std::accumulate(from, from + n, 0.0f) / static_cast<float>(n); };
  const Ends ends{mean(light.begin()), mean(light.rbegin())};
  return differ_by_edge(ends.first, ends.last, noise) ? std::optional(ends) : std::nullopt;
}

/// Channel weights to which the laser adds nothing.
std::array<float, 3> against_laser(const StripeAppearance& appearance, bool clipped) {
  Eigen::Vector3d colour(appearance.light[0], appearance.light[1], appearance.light[2]);
  if (clipped && appearance.colour.norm() > 0) colour = appearance.colour.normalized();
  std::array<float, 3> weights;
  for (int c = 0; c < 3; ++c) weights[c] = static_cast<float>(1 - colour.sum() * colour[c]);
  return weights;
}

ProfileSection with(const ProfileSection& section, const std::vector<float>& reflectance, double start) {
  return {section.values, section.count, start, reflectance.data()};
}

}  // namespace

bool differ_by_edge(double one, double other, double noise) {
  constexpr double kEdge = 0.7, kClear = 6;
  const double top = std::max(one, other);
  return std::abs(one - other) >= kEdge * top && top >= kClear * noise;
}

bool measure_reflectance(const cv::Mat& image, const cv::Mat& background, const StripeAppearance& appearance,
                         const SectionRows& rows, std::vector<float>& reflectance) {
  const int channels = image.channels();
  const bool dark = !background.empty();
  if (dark ? rows.core.width() > 0 : channels < 3) return false;
  const cv::Mat& scene = dark ? background : image;
  const ClippedRun& core = rows.core;  // where the laser's light cannot be told from the rest
  const std::array<float, 3> weights = dark ? appearance.light : against_laser(appearance, core.width() > 0);
  const auto light_at = [&](int y) {
    if (y >= core.first && y <= core.last) y = 2 * y < core.first + core.last ? core.first - 1 : core.last + 1;
    const std::uint8_t* pixel =
        scene.ptr<std::uint8_t>(std::clamp(y, 0, scene.rows - 1)) + static_cast<std::ptrdiff_t>(rows.column) * channels;
    const auto light = [&](int c) { return weights[c] * static_cast<float>(pixel[c]); };
    return channels == 1 ? light(0) : light(0) + light(1) + light(2);
  };
  reflectance.resize(rows.count);
  float above = light_at(rows.first - 1), here = light_at(rows.first);
  for (int i = 0; i < rows.count; ++i) {
    const float below = light_at(rows.first + i + 1);
    reflectance[i] = 0.25f * above + 0.5f * here + 0.25f * below;
    above = here, here = below;
  }
  const auto ends = ends_at_edge(reflectance, dark ? kThroughProfile : kAnywhere, appearance.noise);
  if (!ends) return false;
  for (float& share : reflectance) share = std::max(share / ends->top(), kDarkest);
  return true;
}

bool explains_more(const ProfileFit& cut, const ProfileFit& whole) {
  constexpr double kBetter = 0.7;  // of the misfit
  return cut.ok && (!whole.ok || cut.misfit < kBetter * whole.misfit);
}

ProfileFit fit_cut(const ProfileFitter& fitter, const ProfileSection& section, const ValueNoise& noise, int starts) {
  constexpr double kStep = 1.2;        // [sd]
  constexpr double kEdgeSigma = 0.25;  // [px]
  const float* const share = section.reflectance;
  const double step = (share[0] < share[section.count - 1] ? -kStep : kStep) * fitter.sd();
  ProfileFit best;
  for (int k = 0; k < starts; ++k) {
    const ProfileFit fit = fitter.fit({section.values, section.count, section.start + k * step, share}, noise);
    if (fit.ok && (!best.ok || fit.misfit < best.misfit)) best = fit;
  }
  if (!best.ok) return best;
  thread_local std::vector<float> moved;  // by half a pixel
  moved.assign(share, share + section.count);
  for (int i = 1; i < section.count; ++i) moved[i] = 0.5f * (share[i] + share[i - 1]);
  const ProfileFit there = fitter.fit(with(section, moved, best.position), noise);
  if (there.ok) best.edge_sigma = 2 * kEdgeSigma * std::abs(there.position - best.position);
  best.sigma = std::hypot(best.sigma, best.edge_sigma);
  return best;
}

std::optional<ProfileFit> fit_unseen_edge(const ProfileFitter& fitter, const std::vector<float>& values, double start,
                                          const ValueNoise& noise) {
  const auto ends = ends_at_edge(values, kAnywhere, noise.additive);
  if (!ends) return std::nullopt;
  const int n = static_cast<int>(values.size());
  const ProfileSection section{values.data(), n, start};
  std::vector<float> reflectance(values.size());
  ProfileFit best;
  for (int edge = 1; edge < n; ++edge) {
    for (int i = 0; i < n; ++i) {
      const float share = std::clamp(0.5f + 0.25f * static_cast<float>(2 * (i - edge) + 1), 0.0f, 1.0f);
      reflectance[i] = std::max(kDarkest, (ends->first + share * (ends->last - ends->first)) / ends->top());
    }
    const ProfileFit fit = fit_cut(fitter, with(section, reflectance, start), noise, kStartsInTheDark);
    if (fit.ok && (!best.ok || fit.misfit < best.misfit)) best = fit;
  }
  const ProfileFit whole = fitter.fit(section, noise);
  return explains_more(best, whole) ? best : whole;
}

}  // namespace tankrig
