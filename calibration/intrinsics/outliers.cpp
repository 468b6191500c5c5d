#include "calibration/intrinsics/outliers.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/input_error.hpp"
#include "core/median.hpp"
#include "core/shown_text.hpp"

namespace tankrig {
namespace {

constexpr double kLoss = 1;          // px: of the Cauchy loss
constexpr double kViewFactor = 4;    // a view's median error over that of all views
constexpr double kCornerFactor = 6;  // a corner's error over the sigma of one axis
constexpr double kCoarsest = 1;      // px: a usual error above it is no corner's
constexpr double kFinest = 0.02;     // px: no corner is known better
constexpr double kMostViews = 1 / 3.0;

double median_of(std::vector<double> values) { return values.empty() ? 0 : upper_median(values); }

/// A board seen at a slant has two places that look much alike: takes the better, now that the camera is known better.
void turn_over_misread_views(BoardBundle& bundle) {
  const std::vector<Vector3d> points = bundle.points();
  for (std::size_t v = 0; v < bundle.views.size(); ++v)
    if (bundle.cameras.size() == 1)
      if (const auto pose = board_pose(bundle.cameras[0], points, bundle.views[v].seen[0])) bundle.cMt[v] = pose->cMt;
}

void leave_out_corners(BoardBundle& bundle, const std::vector<CornerResidual>& corners) {
  for (const CornerResidual& corner : corners) {
    FoundBoard& board = bundle.views[corner.view].seen[static_cast<std::size_t>(corner.camera)];
    const auto at = std::find(board.ids.begin(), board.ids.end(), corner.id) - board.ids.begin();
    board.ids.erase(board.ids.begin() + at);
    board.pixels.erase(board.pixels.begin() + at);
  }
}

}  // namespace

std::vector<CornerResidual> leave_out_what_does_not_fit(BoardBundle& bundle) {
  bundle.lens = LensModel::kK1;
  bundle.bends = false;
  solve(bundle, kLoss);
  turn_over_misread_views(bundle);
  bundle.lens = LensModel::kPlumbBob;
  const std::vector<CornerResidual> residuals = solve(bundle, kLoss).residuals;

  std::vector<std::vector<double>> lengths(bundle.views.size());
  for (const CornerResidual& r : residuals) lengths[r.view].push_back(r.error.norm());
  std::vector<double> medians;
  for (const std::vector<double>& view : lengths) medians.push_back(median_of(view));
  const double usual = std::max(median_of(medians), kFinest);
  if (usual > kCoarsest)
    throw InputError(
        fmt::format("found corners {:.1f} px off in most pictures, expected less than {:.0f} px: expected pictures "
                    "of one camera, unchanged, and of one target",
                    usual, kCoarsest));
  std::set<std::size_t> views;
  std::string names;
  for (std::size_t v = 0; v < medians.size(); ++v)
    if (medians[v] > kViewFactor * usual) {
      views.insert(v);
      names += fmt::format("{}{} ({:.2f} px)", names.empty() ? "" : ", ", shown_text(bundle.views[v].name), medians[v]);
    }
  if (double(views.size()) > kMostViews * double(medians.size()))
    throw InputError(
        fmt::format("found {} of {} pictures that do not fit the others' {:.2f} px: {}; expected pictures of one "
                    "camera, unchanged, and of one target",
                    views.size(), medians.size(), usual, names));

  // The median length of two independent errors of sigma is 1.1774 sigma.
  const double sigma = usual / 1.1774;
  std::vector<CornerResidual> corners;
  for (const CornerResidual& r : residuals)
    if (!views.contains(r.view) && r.error.norm() > kCornerFactor * sigma) corners.push_back(r);
  leave_out_corners(bundle, corners);
  for (auto v = views.rbegin(); v != views.rend(); ++v) {
    bundle.views.erase(bundle.views.begin() + static_cast<std::ptrdiff_t>(*v));
    bundle.cMt.erase(bundle.cMt.begin() + static_cast<std::ptrdiff_t>(*v));
  }
  return corners;
}

}  // namespace tankrig
