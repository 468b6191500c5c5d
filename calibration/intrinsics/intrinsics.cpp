#include "calibration/intrinsics/intrinsics.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "calibration/intrinsics/model_choice.hpp"
#include "calibration/intrinsics/outliers.hpp"
#include "core/angles.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kFewestPictures = 3;
constexpr double kMostSystematic = 3;
constexpr double kWorstFocal = 0.02;  // sigma of the focal length, as a share of it

BoardBundle first_bundle(const IntrinsicsProblem& problem) {
  std::vector<FoundBoard> boards;
  for (const BoardPicture& picture : problem.pictures) boards.push_back(picture.board);
  BoardBundle bundle;
  bundle.target = problem.target;
  bundle.cameras = {{first_camera(problem.width, problem.height, problem.target, boards)}};
  bundle.kMc = {Transform::Identity()};
  const std::vector<Vector3d> points = problem.target.points();
  for (const BoardPicture& picture : problem.pictures) {
    const auto pose = board_pose(bundle.cameras.front(), points, picture.board);
    if (!pose) throw InputError(shown_text(picture.name) + ": found corners on one line, expected those of a target");
    bundle.views.push_back({picture.name, {picture.board}});
    bundle.cMt.push_back(pose->cMt);
  }
  return bundle;
}

/// Where the boards are in a camera that is known better.
void place_boards(BoardBundle& bundle) {
  const std::vector<Vector3d> points = bundle.points();
  for (std::size_t v = 0; v < bundle.views.size(); ++v)
    if (const auto pose = board_pose(bundle.cameras.front(), points, bundle.views[v].seen.front()))
      bundle.cMt[v] = pose->cMt;
}

/// The same boards, seen through the port that may be there.
BoardBundle behind_port(const BoardBundle& pinhole, const IntrinsicsProblem& problem) {
  BoardBundle behind = pinhole;
  RationalCamera& camera = behind.cameras.front();
  const double shorter = problem.port->air / problem.port->water;  // than a pinhole in water
  camera.fx *= shorter, camera.fy *= shorter;
  if (problem.in_air) camera = {*problem.in_air};
  camera.port = problem.port;
  place_boards(behind);
  return behind;
}

std::vector<PictureFit> picture_fits(const IntrinsicsProblem& problem, const IntrinsicsSolution& solution) {
  std::map<std::string, std::size_t> used;
  for (std::size_t v = 0; v < solution.bundle.views.size(); ++v) used[solution.bundle.views[v].name] = v;
  std::vector<double> sums(solution.bundle.views.size());
  std::vector<std::size_t> counts(solution.bundle.views.size());
  for (const CornerResidual& r : solution.residuals) sums[r.view] += r.error.squaredNorm(), ++counts[r.view];
  const std::vector<Vector3d> points = solution.bundle.points();
  const Vector3d middle = points.back() / 2;
  std::vector<PictureFit> fits;
  for (const BoardPicture& picture : problem.pictures) {
    PictureFit fit{picture.name, picture.board.ids.size(), 0, 0, 0, true};
    if (const auto at = used.find(picture.name); at != used.end()) {
      const Transform& cMt = solution.bundle.cMt[at->second];
      fit = {picture.name,          counts[at->second], std::sqrt(sums[at->second] / double(counts[at->second])),
             (cMt * middle).norm(), tilt_of(cMt),       false};
    } else if (const auto pose = board_pose({solution.camera}, points, picture.board)) {
      fit.rms = pose->rms, fit.distance = (pose->cMt * middle).norm(), fit.tilt = tilt_of(pose->cMt);
    }
    fits.push_back(fit);
  }
  return fits;
}

/// How far points `distance` away move across their rays when a parameter changes by one, all over the image: root mean
/// square.
double moved_across(const CameraModel& camera, std::size_t parameter, double distance) {
  constexpr int kAcross = 8;
  const CameraParameters values = parameters_of({camera});
  const double step = 1e-6 * std::max(1.0, std::abs(values[parameter]));
  CameraParameters changed = values;
  changed[parameter] += step;
  const RationalCamera other = camera_of(camera, changed);
  double sum = 0;
  for (int row = 0; row < kAcross; ++row)
    for (int column = 0; column < kAcross; ++column) {
      const Vector2d pixel((column + 0.5) * camera.width / kAcross, (row + 0.5) * camera.height / kAcross);
      const Vector3d there = other.ray(pixel.x(), pixel.y()) - camera.ray(pixel.x(), pixel.y());
      sum += (distance / step * there).squaredNorm();
    }
  return std::sqrt(sum) / kAcross;
}

/// The same of a parameter of its port.
double port_moved_across(const CameraModel& camera, std::size_t parameter, double distance) {
  constexpr int kAcross = 8;
  constexpr double kStep = 1e-6;
  PortParameters changed = parameters_of(*camera.port);
  changed[parameter] += kStep;
  CameraModel other = camera;
  other.port = port_of(*camera.port, changed);
  double sum = 0;
  for (int row = 0; row < kAcross; ++row)
    for (int column = 0; column < kAcross; ++column) {
      const double u = (column + 0.5) * camera.width / kAcross, v = (row + 0.5) * camera.height / kAcross;
      const Vector3d along = camera.ray(u, v), moved = other.sight(u, v).at(distance) - camera.sight(u, v).at(distance);
      sum += ((moved - along.dot(moved) * along) / kStep).squaredNorm();
    }
  return std::sqrt(sum) / kAcross;
}

std::vector<Estimate> estimates_of(const IntrinsicsSolution& solution) {
  const BundleLayout& layout = solution.covariance.layout;
  const auto variance = [&](int at) { return solution.covariance.matrix(at, at); };
  const CameraParameters values = parameters_of({solution.camera});
  const double distance = solution.mean_distance();
  std::vector<Estimate> all;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (const int at = layout.cameras.front()[i]; at >= 0)
      all.push_back(estimate(kCameraParameterNames[i], unit_of(i), values[i], variance(at), solution.noise,
                             moved_across(solution.camera, i, distance)));
  if (const int at = layout.ports.front(); at >= 0) {
    const PortParameters port = parameters_of(*solution.camera.port);
    for (std::size_t i = 0; i < port.size(); ++i)
      all.push_back(estimate(kPortParameterNames[i], unit_of_port(i), port[i], variance(at + static_cast<int>(i)),
                             solution.noise, port_moved_across(solution.camera, i, distance)));
  }
  if (layout.bend >= 0)
    for (const int i : {0, 1})
      all.push_back(estimate(i == 0 ? "bend along x" : "bend along y", "m", solution.bundle.bend[i],
                             variance(layout.bend + i), solution.noise, 0));
  return all;
}

}  // namespace

double tilt_of(const Transform& cMt) { return std::acos(std::min(1.0, std::abs(cMt.linear()(2, 2)))); }

Estimate estimate(std::string name, std::string unit, double value, double variance, const ResidualNoise& noise,
                  double moves) {
  const double sigma = noise.allowance * noise.sigma * std::sqrt(variance);
  return {std::move(name), std::move(unit), value, sigma, sigma * interval_factor(noise.degrees), sigma * moves};
}

std::string unit_of(std::size_t camera_parameter) { return camera_parameter < 4 ? "px" : ""; }

std::string unit_of_port(std::size_t port_parameter) { return port_parameter == 0 ? "m" : ""; }

ImageCoverage coverage_of(int width, int height, const std::vector<CornerResidual>& corners) {
  ImageCoverage coverage;
  for (const CornerResidual& corner : corners) {
    const int column = std::clamp(static_cast<int>(corner.pixel.x() * ImageCoverage::kColumns / width), 0,
                                  ImageCoverage::kColumns - 1);
    const int row =
        std::clamp(static_cast<int>(corner.pixel.y() * ImageCoverage::kRows / height), 0, ImageCoverage::kRows - 1);
    ++coverage.corners[static_cast<std::size_t>(row * ImageCoverage::kColumns + column)];
  }
  const auto full = std::count_if(coverage.corners.begin(), coverage.corners.end(), [](int n) { return n > 0; });
  coverage.share = double(full) / double(coverage.corners.size());
  return coverage;
}

ResidualNoise noise_of(const BoardBundle& bundle, const std::vector<CornerResidual>& residuals, int parameters) {
  ResidualNoise noise;
  double sum = 0;
  // Errors by camera, view, column and row of the target.
  std::map<std::tuple<int, std::size_t, int, int>, Vector2d> by_place;
  for (const CornerResidual& r : residuals) {
    sum += r.error.squaredNorm();
    by_place[{r.camera, r.view, r.id % bundle.target.columns, r.id / bundle.target.columns}] = r.error;
  }
  const double count = 2.0 * double(residuals.size());
  noise.degrees = count - parameters;
  if (!(noise.degrees > 0)) throw InputError("found fewer corners than parameters, expected more pictures");
  noise.sigma = std::sqrt(sum / noise.degrees);
  if (!(sum > 0)) return noise;
  // A mean over neighbours that err alike is less well known: its variance grows by 1 + the sum of all correlations.
  double correlations = 0, bends = 0;
  std::size_t triples = 0;
  for (const auto& [columns, rows] : {std::pair{1, 0}, {0, 1}, {1, 1}, {1, -1}, {2, 0}, {0, 2}}) {
    double product = 0;
    std::size_t pairs = 0;
    for (const auto& [at, error] : by_place) {
      const auto& [camera, view, column, row] = at;
      const auto other = by_place.find({camera, view, column + columns, row + rows});
      if (other == by_place.end()) continue;
      product += error.dot(other->second);
      ++pairs;
      const auto before = by_place.find({camera, view, column - columns, row - rows});
      if (std::abs(columns) + std::abs(rows) == 1 && before != by_place.end())
        bends += (before->second - 2 * error + other->second).squaredNorm(), ++triples;
    }
    // What was fitted makes neighbours differ: of independent errors, by about the share of parameters.
    if (pairs > 0)
      correlations += 2 * ((product / double(pairs)) / (sum / double(residuals.size())) + parameters / count);
  }
  noise.allowance = std::sqrt(std::max(1.0, 1 + correlations));
  // Of three independent errors in a row, first - 2 second + third has six times the variance of one.
  if (bends > 0) noise.systematic = std::sqrt(sum / double(residuals.size()) / (bends / double(triples) / 6));
  return noise;
}

void check_observable(const BoardBundle& bundle, const BundleCovariance& covariance, const ResidualNoise& noise) {
  double most_tilted = 0;
  for (const Transform& cMt : bundle.cMt) most_tilted = std::max(most_tilted, tilt_of(cMt));
  const std::string remedy = fmt::format(
      ": tilt the target by 20 to 45 degrees to either side and up and down in several pictures (the most tilted is "
      "{:.0f} "
      "degrees here), and show it in all parts of the image",
      to_degrees(most_tilted));
  if (!covariance.unobservable.empty())
    throw InputError("the pictures do not tell " + covariance.unobservable.front() + remedy);
  for (std::size_t k = 0; k < bundle.cameras.size(); ++k)
    for (const int i : {0, 1}) {
      const int at = covariance.layout.cameras[k][static_cast<std::size_t>(i)];
      if (at < 0) continue;  // held
      const double focal = i == 0 ? bundle.cameras[k].fx : bundle.cameras[k].fy;
      const double sigma = noise.allowance * noise.sigma * std::sqrt(covariance.matrix(at, at));
      if (!(sigma < kWorstFocal * focal))
        throw InputError(fmt::format("the pictures do not tell the focal length: {} = {:.0f} +- {:.0f} px{}",
                                     kCameraParameterNames[static_cast<std::size_t>(i)], focal, sigma, remedy));
    }
}

double IntrinsicsSolution::mean_distance() const {
  double sum = 0;
  std::size_t count = 0;
  for (const PictureFit& picture : pictures)
    if (!picture.left_out) sum += picture.distance, ++count;
  return count > 0 ? sum / double(count) : 0;
}

IntrinsicsSolution solve(const IntrinsicsProblem& problem) {
  if (problem.pictures.size() < kFewestPictures)
    throw InputError(fmt::format("found the target in {} pictures, expected {} at least, better 15 and more",
                                 problem.pictures.size(), kFewestPictures));
  BoardBundle bundle = first_bundle(problem);
  IntrinsicsSolution solution;
  std::optional<BoardBundle> behind;
  if (problem.port) {
    // A pinhole would leave out good pictures: the near ones.
    behind = behind_port(bundle, problem);
    solution.left_out_corners = leave_out_what_does_not_fit(*behind);
    bundle.views = behind->views, bundle.cMt = behind->cMt;
    place_boards(bundle);
    if (problem.in_air) behind = behind_port(bundle, problem), behind->lens_held = true;
  } else {
    solution.left_out_corners = leave_out_what_does_not_fit(bundle);
  }
  ModelChoice choice = choose_model(bundle, problem.lens, behind ? problem.bends.value_or(false) : problem.bends);
  if (behind) choice = choose_port(std::move(choice), *behind, problem.lens);
  solution.bundle = std::move(choice.bundle);
  solution.tried = std::move(choice.tried);
  solution.decision = std::move(choice.decision);
  solution.lens = solution.bundle.lens;
  solution.residuals = std::move(choice.residuals);
  solution.camera = solution.bundle.cameras.front();
  solution.rms = rms(solution.residuals);
  solution.covariance = covariance(solution.bundle);
  solution.noise = noise_of(solution.bundle, solution.residuals, solution.covariance.layout.size);
  if (solution.noise.systematic > kMostSystematic)
    throw InputError(fmt::format(
        "found errors of {:.2f} px that neighbouring corners share ({:.1f} times what changes from corner to corner, "
        "{} "
        "at most): expected pictures of one camera, unchanged, of one flat target, by a lens that the model {} fits",
        solution.rms, solution.noise.systematic, kMostSystematic, name_of(solution.lens)));
  check_observable(solution.bundle, solution.covariance, solution.noise);
  if (!solution.camera.invertible())
    throw InputError(
        fmt::format("the distortion found ({}) folds over within the image: show the target in its corners, "
                    "or ask for a simpler lens model",
                    name_of(solution.lens)));
  solution.pictures = picture_fits(problem, solution);
  solution.estimates = estimates_of(solution);
  solution.coverage = coverage_of(problem.width, problem.height, solution.residuals);
  return solution;
}

}  // namespace tankrig
