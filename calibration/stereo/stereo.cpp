#include "calibration/stereo/stereo.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "calibration/estimate/rotation_vector.hpp"
#include "calibration/stereo/pair_agreement.hpp"
#include "core/input_error.hpp"
#include "core/ray_meeting.hpp"
#include "core/shown_text.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kFewestPairs = 3;
constexpr double kOutlier = 4;  // a pair's median error over that of all pairs

IntrinsicsSolution alone(const StereoProblem& problem, bool right) {
  const cv::Size& size = right ? problem.right_size : problem.left_size;
  IntrinsicsProblem one{
      size.width,   size.height,   problem.target, {},
      problem.lens, problem.bends, problem.port,   right ? problem.right_in_air : problem.left_in_air};
  for (const BoardPair& pair : problem.pairs) one.pictures.push_back({pair.name, right ? pair.right : pair.left});
  try {
    return solve(one);
  } catch (const InputError& e) {
    throw InputError(std::string(right ? "right" : "left") + " camera: " + e.what());
  }
}

/// Corners that both pictures have.
void keep_common_corners(FoundBoard& left, FoundBoard& right) {
  const auto keep = [](FoundBoard& board, const std::vector<int>& ids) {
    FoundBoard kept;
    kept.smallest_spacing = board.smallest_spacing;
    for (std::size_t i = 0; i < board.ids.size(); ++i)
      if (std::binary_search(ids.begin(), ids.end(), board.ids[i])) {
        kept.ids.push_back(board.ids[i]);
        kept.pixels.push_back(board.pixels[i]);
      }
    board = std::move(kept);
  };
  std::vector<int> common;
  std::set_intersection(left.ids.begin(), left.ids.end(), right.ids.begin(), right.ids.end(),
                        std::back_inserter(common));
  keep(left, common), keep(right, common);
}

/// The views that fit each camera by itself, without the corners left out there.
const FoundBoard* used_board(const IntrinsicsSolution& solution, const std::string& name) {
  for (const BoardView& view : solution.bundle.views)
    if (view.name == name) return &view.seen.front();
  return nullptr;
}

BoardBundle joint_bundle(const StereoProblem& problem, const IntrinsicsSolution& left, const IntrinsicsSolution& right,
                         StereoSolution& solution) {
  constexpr std::size_t kFewestCorners = 6;
  BoardBundle bundle;
  bundle.target = problem.target;
  bundle.lens = std::max(left.lens, right.lens);
  bundle.lens_held = left.bundle.lens_held && right.bundle.lens_held;
  bundle.bends = problem.bends.value_or(left.bundle.bends || right.bundle.bends);
  bundle.cameras = {{left.camera}, {right.camera}};
  std::vector<BoardPair> pairs;
  for (const BoardPair& pair : problem.pairs) {
    const FoundBoard *in_left = used_board(left, pair.name), *in_right = used_board(right, pair.name);
    if (!in_left || !in_right) {
      solution.left_out.push_back(pair.name + ": does not fit the " + (in_left ? "right" : "left") +
                                  " camera by itself");
      continue;
    }
    pairs.push_back({pair.name, *in_left, *in_right});
  }
  const PairAgreement agreement = agree_on_pose(left.camera, right.camera, problem.target, pairs);
  solution.turned = agreement.turned;
  for (const std::string& name : agreement.left_out)
    solution.left_out.push_back(name + ": the cameras stand otherwise by this pair: pictures of different moments?");
  bundle.kMc = {Transform::Identity(), agreement.rMc};
  const std::vector<Vector3d> points = problem.target.points();
  for (BoardPair pair : agreement.pairs) {
    keep_common_corners(pair.left, pair.right);
    const auto pose =
        pair.left.ids.size() >= kFewestCorners ? board_pose({left.camera}, points, pair.left) : std::nullopt;
    if (!pose) {
      solution.left_out.push_back(pair.name + ": too few corners in both pictures");
      continue;
    }
    bundle.views.push_back({pair.name, {pair.left, pair.right}});
    bundle.cMt.push_back(pose->cMt);
  }
  if (bundle.views.size() < kFewestPairs)
    throw InputError(
        fmt::format("found {} pairs that fit together, expected {} at least", bundle.views.size(), kFewestPairs));
  return bundle;
}

/// Pairs far off the others, left out one at a time with a fit after each.
std::vector<CornerResidual> fit_without_outliers(BoardBundle& bundle, StereoSolution& solution) {
  for (;;) {
    BundleFit fit = solve(bundle);
    if (!fit.converged) throw InputError("the two cameras do not converge together on these pairs");
    std::vector<double> sums(bundle.views.size()), counts(bundle.views.size());
    for (const CornerResidual& r : fit.residuals) sums[r.view] += r.error.squaredNorm(), ++counts[r.view];
    for (std::size_t v = 0; v < sums.size(); ++v) sums[v] = std::sqrt(sums[v] / counts[v]);
    std::vector<double> sorted = sums;
    std::sort(sorted.begin(), sorted.end());
    const auto worst = std::max_element(sums.begin(), sums.end());
    if (!(*worst > kOutlier * sorted[sorted.size() / 2]) || bundle.views.size() <= kFewestPairs)
      return std::move(fit.residuals);
    const auto v = worst - sums.begin();
    solution.left_out.push_back(fmt::format("{}: {:.2f} px beside the others' {:.2f}",
                                            bundle.views[std::size_t(v)].name, *worst, sorted[sorted.size() / 2]));
    bundle.views.erase(bundle.views.begin() + v);
    bundle.cMt.erase(bundle.cMt.begin() + v);
  }
}

/// Two cameras, and where both place a point that they see, in c.
struct Eyes {
  CameraModel left, right;
  Transform rMc;

  Vector3d place(const Vector2d& in_left, const Vector2d& in_right) const {
    return meeting(left.sight(in_left.x(), in_left.y()), rMc.inverse() * right.sight(in_right.x(), in_right.y()));
  }
};

/// Estimates of what both cameras together tell, with what each does to the places of the targets' middles.
class JointEstimates {
 public:
  JointEstimates(const BoardBundle& bundle, const BundleCovariance& covariance, const ResidualNoise& noise)
      : bundle_(bundle), covariance_(covariance), noise_(noise) {}

  std::vector<Estimate> of_camera(std::size_t k) const {
    const CameraParameters values = parameters_of(bundle_.cameras[k]);
    std::vector<Estimate> all;
    for (std::size_t i = 0; i < values.size(); ++i)
      if (const int at = covariance_.layout.cameras[k][i]; at >= 0) {
        const double step = 1e-6 * std::max(1.0, std::abs(values[i]));
        CameraParameters changed = values;
        changed[i] += step;
        Eyes eyes = found();
        (k == 0 ? eyes.left : eyes.right) = camera_of(bundle_.cameras[k], changed);
        all.push_back(named(kCameraParameterNames[i], unit_of(i), values[i], at, moved(eyes) / step));
      }
    if (const int at = covariance_.layout.ports[k]; at >= 0) {
      const PortParameters port = parameters_of(*bundle_.cameras[k].port);
      for (std::size_t i = 0; i < port.size(); ++i) {
        PortParameters changed = port;
        changed[i] += kStep;
        Eyes eyes = found();
        CameraModel& eye = k == 0 ? eyes.left : eyes.right;
        eye.port = port_of(*eye.port, changed);
        all.push_back(
            named(kPortParameterNames[i], unit_of_port(i), port[i], at + static_cast<int>(i), moved(eyes) / kStep));
      }
    }
    return all;
  }
  std::vector<Estimate> of_translation() const {
    std::vector<Estimate> all;
    for (int i = 0; i < 3; ++i) {
      Eyes eyes = found();
      eyes.rMc.translation()[i] += kStep;
      all.push_back(named(std::string("T ") + "xyz"[i], "m", bundle_.kMc[1].translation()[i],
                          covariance_.layout.relative[1] + 3 + i, moved(eyes) / kStep));
    }
    return all;
  }
  std::vector<Estimate> of_rotation() const {
    const Eigen::AngleAxisd turn(bundle_.kMc[1].rotation());
    const Vector3d r = turn.angle() * turn.axis();
    std::vector<Estimate> all;
    for (int i = 0; i < 3; ++i) {
      const Vector3d more = r + kStep * Vector3d::Unit(i);
      Eyes eyes = found();
      eyes.rMc.linear() = Eigen::AngleAxisd(more.norm(), more.normalized()).toRotationMatrix();
      all.push_back(
          named(std::string("r ") + "xyz"[i], "rad", r[i], covariance_.layout.relative[1] + i, moved(eyes) / kStep));
    }
    return all;
  }

 private:
  static constexpr double kStep = 1e-6;

  Eyes found() const { return {bundle_.cameras[0], bundle_.cameras[1], bundle_.kMc[1]}; }
  Estimate named(std::string name, std::string unit, double value, int at, double moves) const {
    return estimate(std::move(name), std::move(unit), value, covariance_.matrix(at, at), noise_, moves);
  }
  /// Root mean square over the targets [m].
  double moved(const Eyes& eyes) const {
    const Eyes before = found();
    double sum = 0;
    for (const Transform& cMt : bundle_.cMt) {
      const Vector3d p = cMt * (bundle_.target.points().back() / 2);
      const Vector2d left = before.left.project(p).value(), right = before.right.project(before.rMc * p).value();
      sum += (eyes.place(left, right) - before.place(left, right)).squaredNorm();
    }
    return std::sqrt(sum / double(bundle_.cMt.size()));
  }

  const BoardBundle& bundle_;
  const BundleCovariance& covariance_;
  const ResidualNoise& noise_;
};

cv::Matx33d matx(const Eigen::Matrix3d& m) {
  return {m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2)};
}

void rectify(StereoSolution& solution, const std::vector<CornerResidual>& residuals) {
  const CameraModel &left = solution.bundle.cameras[0], &right = solution.bundle.cameras[1];
  const Vector3d t = solution.rMc.translation();
  cv::Mat R1, R2, P1, P2, Q;
  cv::stereoRectify(left.matrix(), left.distortion(), right.matrix(), right.distortion(), {left.width, left.height},
                    cv::Mat(matx(solution.rMc.linear())), cv::Vec3d(t.x(), t.y(), t.z()), R1, R2, P1, P2, Q,
                    cv::CALIB_ZERO_DISPARITY, 0);
  solution.left_rectification = {cv::Matx33d(R1), cv::Matx34d(P1)};
  solution.right_rectification = {cv::Matx33d(R2), cv::Matx34d(P2)};
  const std::vector<Vector3d> points = solution.bundle.points();
  const bool beside = std::abs(t.x()) >= std::abs(t.y());
  const auto across = [&](const CornerResidual& r) {
    const CameraModel& camera = solution.bundle.cameras[static_cast<std::size_t>(r.camera)];
    const Rectification& rectification = r.camera == 0 ? solution.left_rectification : solution.right_rectification;
    const Vector3d seen = solution.bundle.kMc[static_cast<std::size_t>(r.camera)] * solution.bundle.cMt[r.view] *
                          points[static_cast<std::size_t>(r.id)];
    const Vector2d p = camera.normalized(r.pixel.x(), r.pixel.y(), seen.z());
    const cv::Vec3d turned = rectification.R * cv::Vec3d(p.x(), p.y(), 1);
    const cv::Vec3d pixel = rectification.P * cv::Vec4d(turned[0] / turned[2], turned[1] / turned[2], 1, 0);
    return pixel[beside ? 1 : 0];
  };
  // Left corners of a view stand before its right ones, in the same order.
  double sum = 0;
  std::size_t count = 0;
  std::vector<CornerResidual> lefts, rights;
  for (const CornerResidual& r : residuals) (r.camera == 0 ? lefts : rights).push_back(r);
  for (std::size_t i = 0; i < std::min(lefts.size(), rights.size()); ++i) {
    const double apart = across(lefts[i]) - across(rights[i]);
    sum += apart * apart, ++count;
  }
  solution.row_rms = std::sqrt(sum / double(std::max<std::size_t>(count, 1)));
}

}  // namespace

StereoSolution solve(const StereoProblem& problem) {
  if (problem.left_size != problem.right_size)
    throw InputError(fmt::format(
        "found pictures of {} x {} px on the left and of {} x {} px on the right, expected one size: it is one "
        "pair of cameras",
        problem.left_size.width, problem.left_size.height, problem.right_size.width, problem.right_size.height));
  if (problem.pairs.size() < kFewestPairs)
    throw InputError(
        fmt::format("found the target in both pictures of {} pairs, expected {} at least, better 15 and more",
                    problem.pairs.size(), kFewestPairs));
  StereoSolution solution;
  solution.left = alone(problem, false);
  solution.right = alone(problem, true);
  solution.rms_left = solution.left.rms, solution.rms_right = solution.right.rms;
  solution.bundle = joint_bundle(problem, solution.left, solution.right, solution);
  const std::vector<CornerResidual> residuals = fit_without_outliers(solution.bundle, solution);
  solution.rms_stereo = rms(residuals);
  const BundleCovariance joint = covariance(solution.bundle);
  solution.noise = noise_of(solution.bundle, residuals, joint.layout.size);
  check_observable(solution.bundle, joint, solution.noise);
  for (const CameraModel& camera : solution.bundle.cameras)
    if (!camera.invertible())
      throw InputError("the distortion found folds over within the image: ask for a simpler lens model");
  const JointEstimates estimates(solution.bundle, joint, solution.noise);
  solution.left_estimates = estimates.of_camera(0);
  solution.right_estimates = estimates.of_camera(1);
  solution.translation = estimates.of_translation();
  solution.rotation = estimates.of_rotation();
  solution.rMc = solution.bundle.kMc[1];
  const Eigen::AngleAxisd turn(solution.rMc.rotation());
  Eigen::Matrix<double, 6, 6> step = Eigen::Matrix<double, 6, 6>::Identity();
  step.topLeftCorner<3, 3>() = left_jacobian(turn.angle() * turn.axis());
  const double sigma = solution.noise.sigma * solution.noise.allowance;
  const int at = joint.layout.relative[1];
  solution.covariance = sigma * sigma * step * joint.matrix.block<6, 6>(at, at) * step.transpose();
  rectify(solution, residuals);
  return solution;
}

}  // namespace tankrig
