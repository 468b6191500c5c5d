#include "reconstruction/stripe/fit/cut_profile.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "core/median.hpp"

namespace tankrig {
namespace {

constexpr float kDarkest = 0.03f;  ///< of the reflectance over its largest
constexpr double kEdge = 0.7;      ///< least drop from the brighter side's light to the darker's, over the former
constexpr double kWhole = 0.9;  ///< chance beforehand of no edge: behind most of them is a surface without the stripe

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

float share_of(float light, float top, double veil) {
  const auto veiled = static_cast<float>(veil) * top;
  return std::max((light - veiled) / (top - veiled), kDarkest);
}

/// The likeliest of fits without an edge and with one of several, to nearly the same values.
ProfileFit likeliest(const ProfileFit& whole, std::span<const ProfileFit> cut) {
  std::vector<ProfileFit> fits = {whole};
  fits.insert(fits.end(), cut.begin(), cut.end());
  double least = HUGE_VAL;
  for (const ProfileFit& fit : fits)
    if (fit.ok) least = std::min(least, fit.misfit);
  std::vector<double> chances;
  for (const ProfileFit& fit : fits) {
    const double before = chances.empty() ? kWhole : (1 - kWhole) / static_cast<double>(cut.size());
    const double freedom = fit.freedom,
                 over = (kPriorFreedom + freedom * fit.misfit) / (kPriorFreedom + freedom * least);
    chances.push_back(fit.ok ? before * std::pow(over, -0.5 * (kPriorFreedom + freedom)) : 0);
  }
  ProfileFit best = fits[std::ranges::max_element(chances) - chances.begin()];
  double sum = 0, apart = 0;
  for (std::size_t k = 0; k < fits.size(); ++k) {
    sum += chances[k];
    if (chances[k] > 0) apart += chances[k] * std::pow(fits[k].position - best.position, 2);
  }
  if (sum > 0) best.sigma = std::hypot(best.sigma, std::sqrt(apart / sum));
  return best;
}

ProfileSection with(const ProfileSection& section, const std::vector<float>& reflectance, double start) {
  return {section.values, section.count, start, reflectance.data()};
}

}  // namespace

bool differ_by_edge(double one, double other, double noise) {
  constexpr double kClear = 6;
  const double top = std::max(one, other);
  return std::abs(one - other) >= kEdge * top && top >= kClear * noise;
}

double veil_of(const std::vector<SurfaceLight>& samples, double noise) {
  constexpr std::size_t kLeast = 8;
  constexpr double kBright = 0.7, kLeastVeil = -0.3, kMostOfDark = 0.9;
  double top = 0;
  for (const SurfaceLight& sample : samples) top = std::max(top, sample.scene);
  std::vector<double> scene[2], laser[2];  // of bright parts, of dark ones
  for (const SurfaceLight& sample : samples) {
    const bool dark = differ_by_edge(sample.scene, top, noise);
    if (!dark && sample.scene < kBright * top) continue;
    scene[dark].push_back(sample.scene);
    laser[dark].push_back(sample.laser);
  }
  if (std::min(scene[0].size(), scene[1].size()) < kLeast) return 0;
  const double of_scene = upper_median(scene[1]) / upper_median(scene[0]),
               of_laser = upper_median(laser[1]) / upper_median(laser[0]);
  if (!(of_scene > 0 && of_laser < 1 - kEdge)) return 0;
  return std::clamp((of_scene - of_laser) / (1 - of_laser), kLeastVeil, kMostOfDark * of_scene);
}

bool measure_reflectance(const cv::Mat& image, const cv::Mat& background, const StripeAppearance& appearance,
                         const SectionRows& rows, double veil, std::vector<float>& reflectance) {
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
  for (int i = 0; i < rows.count; ++i) reflectance[i] = light_at(rows.first + i);
  const auto ends = ends_at_edge(reflectance, dark ? kThroughProfile : kAnywhere, appearance.noise);
  if (!ends) return false;
  for (float& light : reflectance) light = share_of(light, ends->top(), veil);
  return true;
}

ProfileFit likelier(const ProfileFit& whole, const ProfileFit& cut) { return likeliest(whole, {&cut, 1}); }

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
                                          const ValueNoise& noise, double veil) {
  const auto ends = ends_at_edge(values, kAnywhere, noise.additive);
  if (!ends) return std::nullopt;
  const int n = static_cast<int>(values.size());
  const ProfileSection section{values.data(), n, start};
  std::vector<float> reflectance(values.size());
  std::vector<ProfileFit> fits;
  for (const float sharpness : {0.25f, 1.0f})  // over two pixels, or less than one
    for (int edge = 1; edge < n; ++edge) {
      for (int i = 0; i < n; ++i) {
        const float share = std::clamp(0.5f + sharpness * static_cast<float>(2 * (i - edge) + 1), 0.0f, 1.0f);
        reflectance[i] = share_of(ends->first + share * (ends->last - ends->first), ends->top(), veil);
      }
      fits.push_back(fit_cut(fitter, with(section, reflectance, start), noise, kStartsInTheDark));
    }
  return likeliest(fitter.fit(section, noise), fits);
}

}  // namespace tankrig
