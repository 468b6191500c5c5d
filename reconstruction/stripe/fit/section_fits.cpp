#include "reconstruction/stripe/fit/section_fits.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "reconstruction/stripe/fit/cut_profile.hpp"
#include "reconstruction/stripe/fit/plateau_fit.hpp"

namespace tankrig {

SectionFits::SectionFits(const StripeImage& image)
    : image_(image), fitter_(image.appearance.sd_px, image.background.empty()) {
  if (image.appearance.faintest_sd_px > 0) faintest_fitter_.emplace(image.appearance.faintest_sd_px, true);
}

void SectionFits::measure_veil(const std::vector<StripeRun>& runs) {
  std::size_t longest = 0;
  for (const StripeRun& run : runs) {
    const double veil = run.size() > longest ? veil_along(run) : 0;
    if (veil != 0) veil_ = veil, longest = run.size();
  }
}

/// Within one run, which is one surface: behind another's edge the laser is brighter or darker for other reasons.
double SectionFits::veil_along(const StripeRun& run) {
  constexpr std::size_t kLeast = 60, kMostSamples = 60;
  if (run.size() < kLeast) return 0;
  StripeRun sampled;
  std::vector<SurfaceLight> lights;
  double darkest = HUGE_VAL, brightest = 0;
  for (std::size_t i = 0; i < run.size(); i += run.size() / kMostSamples + 1) {
    const auto light = scene_light(run[i]);
    if (!light) continue;
    darkest = std::min(darkest, *light), brightest = std::max(brightest, *light);
    sampled.push_back(run[i]), lights.push_back({*light, NAN});
  }
  if (lights.empty() || !differ_by_edge(darkest, brightest, image_.appearance.noise)) return 0;
  for (std::size_t i = 0; i < sampled.size(); ++i) {
    const Section section = cut(sampled[i]);
    fill_values(sampled[i].column, section.first_row, section.first_row + static_cast<int>(values_.size()) - 1,
                image_.appearance.light);
    lights[i].laser = fit_values(sampled[i].candidate.row - section.first_row, 0).amplitude;
  }
  std::erase_if(lights, [](const SurfaceLight& light) { return !(light.laser > 0); });
  return veil_of(lights, image_.appearance.noise);
}

std::optional<double> SectionFits::scene_light(const PathPoint& point) {
  Section section = cut(point);
  if (section.core.rows.width() >= kWidePlateau) return std::nullopt;
  section.core = {};
  if (crosses_edge(point.column, section)) return std::nullopt;
  const bool seen_apart = !image_.background.empty() || image_.pixels.channels() == 3;
  const std::vector<float>& scene = seen_apart ? reflectance_ : values_;
  if (differ_by_edge(scene.front(), scene.back(), image_.appearance.noise)) return std::nullopt;
  return 0.5 * (scene.front() + scene.back());
}

/// Most points are plain; they are fitted together.
std::vector<ProfileFit> SectionFits::fit(const StripeRun& points, double contrast) {
  const std::size_t most = 2 * static_cast<std::size_t>(reach()) + 1;
  std::vector<ProfileFit> fits(points.size());
  std::vector<float> values(points.size() * most);
  std::vector<ProfileSection> sections;
  std::vector<std::pair<std::size_t, int>> plain;  // points and the first rows of their sections
  const std::vector<std::optional<ProfileFit>> by_faintest = fit_faintest(points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (by_faintest[i]) {
      fits[i] = *by_faintest[i];
      continue;
    }
    Section section = cut(points[i]);
    if (const auto fit = fit_alone(points[i], section, contrast)) {
      fits[i] = *fit;
      fits[i].position += section.first_row;
      continue;
    }
    float* const kept = values.data() + sections.size() * most;
    std::ranges::copy(values_, kept);
    sections.push_back({kept, static_cast<int>(values_.size()), points[i].candidate.row - section.first_row});
    plain.emplace_back(i, section.first_row);
  }
  const std::vector<ProfileFit> together = fitter_.fit(sections, {image_.appearance.noise, contrast});
  for (std::size_t i = 0; i < together.size(); ++i) {
    const auto [point, first_row] = plain[i];
    fits[point] = together[i];
    fits[point].position += first_row;
  }
  return fits;
}

SectionFits::Core SectionFits::core_of(const PathPoint& point) const {
  const ClippedRun core = image_.cores.at(point.column, point.candidate.row, 1);
  if (core.width() >= kWidePlateau) return {core, true};
  return {image_.clipped.at(point.column, point.candidate.row, 0.5 * reach()), false};
}

SectionFits::Section SectionFits::cut(const PathPoint& point, int most_beyond_core) {
  Section section{0, core_of(point)};
  const ClippedRun& core = section.core.rows;
  int middle = static_cast<int>(std::lround(point.candidate.row)), on_either_side = reach();
  if (core.width() > 0) {
    middle = (core.first + core.last) / 2;
    on_either_side = std::min(on_either_side, most_beyond_core) + core.width() / 2;
  }
  section.first_row = std::max(0, middle - on_either_side);
  fill_values(point.column, section.first_row, std::min(image_.pixels.rows - 1, middle + on_either_side),
              section.core.white ? image_.appearance.faintest
              : core.width() > 0 ? image_.appearance.light
                                 : image_.appearance.profile);
  return section;
}

std::span<const float> SectionFits::light_across(int column, int first, int last) {
  if (first < 0 || last >= image_.pixels.rows) return {};
  fill_values(column, first, last, image_.appearance.profile);
  return values_;
}

void SectionFits::fill_values(int column, int first, int last, const std::array<float, 3>& weights) {
  const cv::Mat &image = image_.pixels, &background = image_.background;
  const int channels = image.channels();
  const auto at = static_cast<std::ptrdiff_t>(column) * channels;
  const bool dark = !background.empty();
  const auto fill = [&](auto value_of) {
    const std::uint8_t* pixel = image.ptr<std::uint8_t>(first) + at;
    const std::uint8_t* unlit = dark ? background.ptr<std::uint8_t>(first) + at : nullptr;
    values_.resize(last + 1 - first);
    for (float& value : values_) {
      value = value_of([=](int c) { return weights[c] * static_cast<float>(pixel[c] - (unlit ? unlit[c] : 0)); });
      pixel += image.step;
      if (unlit) unlit += background.step;
    }
  };
  if (channels == 1)
    fill([](auto light) { return light(0); });
  else
    fill([](auto light) { return light(0) + light(1) + light(2); });
}

std::optional<ProfileFit> SectionFits::fit_alone(const PathPoint& point, Section& section, double contrast) {
  if (section.core.rows.width() > 0) return fit_clipped(point, section);
  const double start = point.candidate.row - section.first_row;
  if (crosses_edge(point.column, section))
    return likelier(fit_values(start, contrast), fit_cut_values(start, contrast, 1));
  if (image_.background.empty() && image_.pixels.channels() == 1)
    return fit_unseen_edge(fitter_, values_, start, {image_.appearance.noise, contrast}, veil_);
  return std::nullopt;
}

/// Where other channels clip, the faintest shows the whole profile. It tells nearly all of a run's points or none: the
/// fits to flanks lie elsewhere by fractions of a pixel.
std::vector<std::optional<ProfileFit>> SectionFits::fit_faintest(const StripeRun& points) {
  constexpr double kVisible = 120;  // [DN]
  constexpr double kNearlyAll = 0.8;
  std::vector<std::optional<ProfileFit>> fits(points.size());
  if (!faintest_fitter_) return fits;
  const int reach = faintest_fitter_->half_window() + 2;
  std::size_t taken = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Section section = cut(points[i]);
    const ClippedRun& core = section.core.rows;
    if (core.width() == 0 || section.core.white || crosses_edge(points[i].column, section)) continue;
    const int middle = (core.first + core.last) / 2, first = std::max(0, middle - reach);
    fill_values(points[i].column, first, std::min(image_.pixels.rows - 1, middle + reach), image_.appearance.faintest);
    ProfileFit fit = faintest_fitter_->fit(
        {values_.data(), static_cast<int>(values_.size()), 0.5 * (core.first + core.last) - first},
        {image_.appearance.noise, 0});
    if (!fit.ok || fit.amplitude < kVisible) continue;
    fit.position += first;
    fit.width_ratio *= faintest_fitter_->sd() / image_.appearance.sd_px;
    fits[i] = fit;
    ++taken;
  }
  if (static_cast<double>(taken) < kNearlyAll * static_cast<double>(points.size()))
    fits.assign(points.size(), std::nullopt);
  return fits;
}

/// By both flanks of a wide plateau, otherwise as if it were not clipped.
/// A white core is fitted once more, by what lies beside it, where the flanks are too wide to be its own: haze.
ProfileFit SectionFits::fit_clipped(const PathPoint& point, Section& section) {
  constexpr double kFullWidthOfSd = 2.3548, kHazy = 1.5;  // sd of the flanks in widths of the core
  constexpr int kBesideCore = 10;                         // [px] of a white one
  const auto core = [&] {
    return ClippedRun{section.core.rows.first - section.first_row, section.core.rows.last - section.first_row};
  };
  if (core().width() >= kWidePlateau) {
    const auto plateau = [&] {
      const auto fit_with = [&](const float* reflectance) {
        return fit_plateau(values_, core(), image_.appearance.noise, image_.background.empty(), reflectance);
      };
      const PlateauFit whole = fit_with(nullptr);
      if (!crosses_edge(point.column, section)) return whole;
      const PlateauFit cut = fit_with(reflectance_.data());
      const ProfileFit likely = likelier(whole.profile, cut.profile);
      PlateauFit fit = likely.position == cut.profile.position ? cut : whole;
      fit.profile = likely;
      return fit;
    };
    PlateauFit fit = plateau();
    if (section.core.white && (!fit.profile.ok || fit.sd_px > kHazy * core().width())) {
      section = cut(point, kBesideCore);
      fit = plateau();
    }
    fit.profile.width_ratio = std::min(fit.sd_px, fit.half_height_px / kFullWidthOfSd) / image_.appearance.sd_px;
    if (fit.profile.ok) return fit.profile;
  }
  // A clipped core carries no speckle, and its flanks no more than their share.
  const double middle = 0.5 * (core().first + core().last);
  const ProfileFit whole = fit_values(middle, 0);
  if (!crosses_edge(point.column, section)) return whole;
  for (int i = core().first; i <= core().last; ++i) values_[i] = reflectance_[i] = 0;  // what is clipped tells nothing
  return likelier(whole, fit_cut_values(middle, 0, kStartsInTheDark));
}

ProfileFit SectionFits::fit_values(double start, double contrast) const {
  return fitter_.fit({values_.data(), static_cast<int>(values_.size()), start}, {image_.appearance.noise, contrast});
}

ProfileFit SectionFits::fit_cut_values(double start, double contrast, int starts) const {
  return fit_cut(fitter_, {values_.data(), static_cast<int>(values_.size()), start, reflectance_.data()},
                 {image_.appearance.noise, contrast}, starts);
}

bool SectionFits::crosses_edge(int column, const Section& section) {
  const SectionRows rows{column, section.first_row, static_cast<int>(values_.size()), section.core.rows};
  return measure_reflectance(image_.pixels, image_.background, image_.appearance, rows, veil_, reflectance_);
}

}  // namespace tankrig
