// The stripe's sub-pixel position in each section across it, by the fit that the section calls for: plain, clipped, or cut
// by an edge of the scene.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "reconstruction/stripe/find/clipped_runs.hpp"
#include "reconstruction/stripe/find/stripe_image.hpp"
#include "reconstruction/stripe/find/stripe_path.hpp"
#include "reconstruction/stripe/fit/profile_fit.hpp"

namespace tankrig {

/// Of one image. Threads: one.
class SectionFits {
 public:
  explicit SectionFits(const StripeImage& image);

  /// Rows on either side of a point that a plain fit looks at.
  int half_window() const { return fitter_.half_window(); }

  bool is_clipped(const PathPoint& point) const { return core_of(point).rows.width() > 0; }

  /// Of the stripe's profile [px].
  double sd() const { return fitter_.sd(); }

  /// The stripe's light in rows [first, last] of a column, until the next call; empty where the image ends first.
  std::span<const float> light_across(int column, int first, int last);

  /// Measures how much darker the scene's dark parts are to the laser than they look; later fits across their edges use it.
  void measure_veil(const std::vector<StripeRun>& runs);

  /// Of each point of a run, positions in rows of the image. `contrast`: of speckle.
  std::vector<ProfileFit> fit(const StripeRun& points, double contrast);

 private:
  struct Core {
    ClippedRun rows;     ///< of the image; empty: none
    bool white = false;  ///< of all channels
  };
  Core core_of(const PathPoint& point) const;

  /// Rows on either side of a point where nothing is clipped.
  int reach() const { return half_window() + 2; }

  /// The values across the stripe are in `values_`.
  struct Section {
    int first_row = 0;
    Core core;
  };
  static constexpr int kAll = std::numeric_limits<int>::max();
  Section cut(const PathPoint& point, int most_beyond_core = kAll);  ///< rows
  void fill_values(int column, int first, int last, const std::array<float, 3>& weights);

  double veil_along(const StripeRun& run);

  /// The scene's light beside the stripe; none where an edge divides the section, or a wide plateau clips.
  std::optional<double> scene_light(const PathPoint& point);

  std::vector<std::optional<ProfileFit>> fit_faintest(const StripeRun& points);

  /// Of a section that is not plain; none of one that is.
  std::optional<ProfileFit> fit_alone(const PathPoint& point, Section& section, double contrast);
  ProfileFit fit_clipped(const PathPoint& point, Section& section);

  ProfileFit fit_values(double start, double contrast) const;
  ProfileFit fit_cut_values(double start, double contrast, int starts) const;

  /// Whether an edge of the surface's brightness divides the section: then `reflectance_` is that of its values.
  bool crosses_edge(int column, const Section& section);

  const StripeImage& image_;
  ProfileFitter fitter_;
  std::optional<ProfileFitter> faintest_fitter_;
  double veil_ = 0;  ///< of `cut_profile`
  std::vector<float> values_, reflectance_;
};

}  // namespace tankrig
