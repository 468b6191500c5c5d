#include "calibration/object_pose/clicks.hpp"

#include <fmt/core.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <opencv2/calib3d.hpp>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kLeastCorners = 4;
constexpr std::size_t kMostShuffled = 7;  // corners of which every order is tried
constexpr double kSamePlace_px = 2;
constexpr double kEdgeOn =
    0.1;  // how far beside the camera, as a share of the distance, nothing may see a hidden corner
constexpr double kLeastWidth = 0.02;  // of a set of points: its second extent, as a share of its first

/// Second singular value of centred points, as a share of the first.
double width_of(const Eigen::MatrixXd& points) {
  const Eigen::MatrixXd centred = points.rowwise() - points.colwise().mean();
  const Eigen::VectorXd values = Eigen::JacobiSVD<Eigen::MatrixXd>(centred).singularValues();
  return values[0] > 0 ? values[1] / values[0] : 0;
}

/// Error of the best pose of points at rays, by OpenCV's SQPnP [px].
double fit_px(const CameraModel& camera, const std::vector<cv::Point3d>& points, const std::vector<cv::Point2d>& rays) {
  cv::Mat turn, place;
  try {
    if (!cv::solvePnP(points, rays, cv::Matx33d::eye(), cv::noArray(), turn, place, false, cv::SOLVEPNP_SQPNP))
      return std::numeric_limits<double>::infinity();
  } catch (const cv::Exception&) {  // it has no answer
    return std::numeric_limits<double>::infinity();
  }
  std::vector<cv::Point2d> expected;
  cv::projectPoints(points, turn, place, cv::Matx33d::eye(), cv::noArray(), expected);
  double squares = 0;
  for (std::size_t k = 0; k < rays.size(); ++k) squares += (expected[k] - rays[k]).ddot(expected[k] - rays[k]);
  return camera.fx * std::sqrt(squares / static_cast<double>(rays.size()));
}

/// What would make the clicks fit; empty: nothing known.
std::string remedy(const ObjectPoseProblem& problem, double fits_px) {
  constexpr double kTypicalDepth = 1;  // [m] behind a port
  const std::vector<ClickedCorner>& corners = problem.corners;
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> rays, mirrored;
  for (const ClickedCorner& c : corners) {
    points.emplace_back(c.o.x(), c.o.y(), c.o.z());
    const Vector2d ray = problem.camera.normalized(c.pixel.x(), c.pixel.y(), kTypicalDepth);
    rays.emplace_back(ray.x(), ray.y());
    mirrored.emplace_back(-ray.x(), ray.y());
  }
  for (std::size_t a = 0; a < corners.size(); ++a)
    for (std::size_t b = a + 1; b < corners.size(); ++b) {
      std::vector<cv::Point2d> swapped = rays;
      std::swap(swapped[a], swapped[b]);
      if (const double rms = fit_px(problem.camera, points, swapped); rms < fits_px)
        return fmt::format("; the clicks of {} and {} are swapped: with each other's they err by {:.1f} px",
                           corners[a].name, corners[b].name, rms);
    }
  if (const double rms = fit_px(problem.camera, points, mirrored); rms < fits_px)
    return fmt::format(
        "; the corners go round the other way: they are named, or the picture is, mirrored ({:.1f} px if it is "
        "mirrored back)",
        rms);
  if (corners.size() > kMostShuffled) return "";
  std::vector<std::size_t> order(corners.size());
  std::iota(order.begin(), order.end(), 0);
  while (std::next_permutation(order.begin(), order.end())) {
    std::vector<cv::Point2d> shuffled;
    for (const std::size_t k : order) shuffled.push_back(rays[k]);
    if (const double rms = fit_px(problem.camera, points, shuffled); rms < fits_px) {
      std::string names;
      for (std::size_t k = 0; k < order.size(); ++k) names += (k ? ", " : "") + corners[order[k]].name;
      return fmt::format("; clicked in another order they err by {:.1f} px: {}", rms, names);
    }
  }
  return "";
}

/// From the camera and all around it: a face that is nearly edge-on may be either.
bool hidden(const ObjectShape& shape, const Transform& cMo, const Vector3d& o) {
  const double aside = kEdgeOn * cMo.translation().norm();
  const Transform oMc = cMo.inverse();
  for (const Vector3d& eye : {Vector3d(0, 0, 0), Vector3d(aside, 0, 0), Vector3d(-aside, 0, 0), Vector3d(0, aside, 0),
                              Vector3d(0, -aside, 0)})
    if (shape.sees(oMc * eye, o)) return false;
  return true;
}

}  // namespace

double clicks_rms(const CameraModel& camera, const std::vector<ClickedCorner>& corners, const Transform& cMo) {
  double squares = 0;
  for (const ClickedCorner& c : corners) {
    const auto pixel = camera.project(cMo * c.o);
    if (!pixel) return std::numeric_limits<double>::infinity();
    squares += (*pixel - c.pixel).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(corners.size()));
}

void check_clicks(const ObjectPoseProblem& problem) {
  const std::vector<ClickedCorner>& corners = problem.corners;
  if (corners.size() < kLeastCorners)
    throw InputError(fmt::format("object pose: found {} corners, expected at least {}", corners.size(), kLeastCorners));
  Eigen::MatrixXd points(corners.size(), 3), pixels(corners.size(), 2);
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const ClickedCorner& c = corners[k];
    if (!problem.camera.contains(c.pixel))
      throw InputError(
          fmt::format("object pose: {} was clicked at ({:.1f}, {:.1f}), outside of the picture of {} x {} px", c.name,
                      c.pixel.x(), c.pixel.y(), problem.camera.width, problem.camera.height));
    for (std::size_t other = 0; other < k; ++other) {
      if ((corners[other].pixel - c.pixel).norm() < kSamePlace_px)
        throw InputError(fmt::format("object pose: {} and {} were clicked at one place", corners[other].name, c.name));
      if ((corners[other].o - c.o).norm() < 1e-6)
        throw InputError(
            fmt::format("object pose: {} and {} are one point of the object", corners[other].name, c.name));
    }
    points.row(static_cast<Eigen::Index>(k)) = c.o.transpose();
    pixels.row(static_cast<Eigen::Index>(k)) = c.pixel.transpose();
  }
  if (width_of(points) < kLeastWidth)
    throw InputError("object pose: the corners lie in a line on the object, expected points that span a surface");
  if (width_of(pixels) < kLeastWidth)
    throw InputError(
        "object pose: the clicks lie in a line in the picture, expected corners of a surface that is not seen edge-on");
}

void refuse_wrong_clicks(const ObjectPoseProblem& problem, const Transform& cMo, double rms_px) {
  if (!(rms_px <= problem.most_rms_px)) {
    std::size_t worst = 0;
    double most = 0;
    for (std::size_t k = 0; k < problem.corners.size(); ++k) {
      const auto pixel = problem.camera.project(cMo * problem.corners[k].o);
      const double error = pixel ? (*pixel - problem.corners[k].pixel).norm() : std::numeric_limits<double>::infinity();
      if (error > most) most = error, worst = k;
    }
    throw InputError(
        fmt::format("object pose: the clicks err by {:.1f} px, expected at most {:.1f}; {} errs most, by {:.1f} px{}",
                    rms_px, problem.most_rms_px, problem.corners[worst].name, most,
                    remedy(problem, std::min(problem.most_rms_px, rms_px / 3))));
  }
  for (const ClickedCorner& c : problem.corners)
    if (hidden(problem.shape, cMo, c.o))
      throw InputError(
          fmt::format("object pose: the object would hide {}, which was clicked: the corners go round the other way, "
                      "or another object is there",
                      c.name));
}

Eigen::Matrix<double, 6, 6> in_object(const Transform& cMo, const Eigen::Matrix<double, 6, 6>& covariance) {
  Eigen::Matrix<double, 6, 6> turn = Eigen::Matrix<double, 6, 6>::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = cMo.linear().transpose();
  return turn * covariance * turn.transpose();
}

}  // namespace tankrig
