// Where a calibration begins: a focal length among many, and a place for every board.
#include <ceres/ceres.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "calibration/estimate/differentiable.hpp"
#include "calibration/estimate/least_squares.hpp"
#include "calibration/intrinsics/board_bundle.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

std::vector<Vector3d> seen_points(const std::vector<Vector3d>& points, const FoundBoard& board) {
  std::vector<Vector3d> seen;
  for (const int id : board.ids) seen.push_back(points[static_cast<std::size_t>(id)]);
  return seen;
}

double rms_at(const cv::Mat& matrix, const cv::Mat& distortion, const std::vector<cv::Point3d>& points,
              const std::vector<cv::Point2d>& pixels, const cv::Mat& turn, const cv::Mat& shift) {
  std::vector<cv::Point2d> projected;
  cv::projectPoints(points, turn, shift, matrix, distortion, projected);
  double sum = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) sum += (projected[i] - pixels[i]).dot(projected[i] - pixels[i]);
  return std::sqrt(sum / static_cast<double>(pixels.size()));
}

std::optional<BoardPose> pinhole_pose(const RationalCamera& camera, const std::vector<Vector3d>& seen,
                                      const std::vector<Vector2d>& seen_at) {
  std::vector<cv::Point3d> flat, bent;
  std::vector<cv::Point2d> pixels;
  for (const Vector3d& p : seen) flat.emplace_back(p.x(), p.y(), 0), bent.emplace_back(p.x(), p.y(), p.z());
  for (const Vector2d& p : seen_at) pixels.emplace_back(p.x(), p.y());
  const cv::Mat matrix(camera.matrix());
  const cv::Mat distortion = (cv::Mat_<double>(1, 8) << camera.k1, camera.k2, camera.p1, camera.p2, camera.k3,
                              camera.k4, camera.k5, camera.k6);
  std::vector<cv::Mat> turns, shifts;
  try {
    cv::solvePnPGeneric(flat, pixels, matrix, distortion, turns, shifts, false, cv::SOLVEPNP_IPPE);
  } catch (const cv::Exception&) {
    return std::nullopt;  // points on one line
  }
  std::optional<BoardPose> best;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    cv::solvePnPRefineLM(bent, pixels, matrix, distortion, turns[i], shifts[i]);
    const Vector3d r(turns[i].at<double>(0), turns[i].at<double>(1), turns[i].at<double>(2));
    Transform cMt = Transform::Identity();
    if (r.norm() > 0) cMt.linear() = Eigen::AngleAxisd(r.norm(), r.normalized()).toRotationMatrix();
    cMt.translation() = Vector3d(shifts[i].at<double>(0), shifts[i].at<double>(1), shifts[i].at<double>(2));
    const bool in_front = std::all_of(seen.begin(), seen.end(), [&](const Vector3d& p) { return (cMt * p).z() > 0; });
    const double error = rms_at(matrix, distortion, bent, pixels, turns[i], shifts[i]);
    if (in_front && std::isfinite(error) && (!best || error < best->rms)) best = BoardPose{cMt, error};
  }
  return best;
}

struct CornerError {
  const CameraModel* camera;
  Vector3d point;
  Vector2d pixel;
  Transform cMt;

  template <class T>
  bool operator()(const T* step, T* out) const {
    if (!project<T>(*camera, moved(cMt, step) * point.cast<T>(), out)) return false;
    out[0] -= pixel.x(), out[1] -= pixel.y();
    return true;
  }
};

/// A pinhole's pose of what the port shows at the depths of the pose before, until both agree; then the least error.
std::optional<BoardPose> pose_behind_port(const CameraModel& camera, const std::vector<Vector3d>& seen,
                                          const std::vector<Vector2d>& pixels) {
  const RationalCamera pinhole{{camera.width, camera.height, 1, 1, 0, 0}};
  std::optional<BoardPose> pose;
  for (int round = 0; round < kPortRounds; ++round) {
    std::vector<Vector2d> places;
    for (std::size_t i = 0; i < seen.size(); ++i)
      places.push_back(camera.normalized(pixels[i].x(), pixels[i].y(), pose ? (pose->cMt * seen[i]).z() : 1));
    pose = pinhole_pose(pinhole, seen, places);
    if (!pose) return pose;
  }
  std::array<double, kPoseStep> step{};
  ceres::Problem problem;
  for (std::size_t i = 0; i < seen.size(); ++i)
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<CornerError, 2, kPoseStep>(
                                 new CornerError{&camera, seen[i], pixels[i], pose->cMt}),
                             nullptr, step.data());
  try {
    minimise(problem, "board");
  } catch (const InputError&) {
    return std::nullopt;  // it would be inside of the housing
  }
  pose->cMt = moved(pose->cMt, step.data());
  double squares = 0;
  problem.Evaluate({}, &squares, nullptr, nullptr, nullptr);  // half their sum
  pose->rms = std::sqrt(2 * squares / static_cast<double>(seen.size()));
  return pose;
}

}  // namespace

std::optional<BoardPose> board_pose(const RationalCamera& camera, const std::vector<Vector3d>& points,
                                    const FoundBoard& board) {
  const std::vector<Vector3d> seen = seen_points(points, board);
  return camera.port ? pose_behind_port(camera, seen, board.pixels) : pinhole_pose(camera, seen, board.pixels);
}

CameraModel first_camera(int width, int height, const BoardTarget& target, const std::vector<FoundBoard>& boards) {
  constexpr double kFar = 20;  // px: a board that fits worse does not count more
  const std::vector<Vector3d> points = target.points();
  std::optional<CameraModel> best;
  double least = std::numeric_limits<double>::infinity();
  for (const double ratio : {1.0, 0.5, 2.0})
    for (const double focal : {0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 6.0}) {
      const RationalCamera camera{
          {width, height, focal * width, ratio * focal * width, (width - 1) / 2.0, (height - 1) / 2.0}};
      double sum = 0;
      for (const FoundBoard& board : boards) {
        const auto pose = board_pose(camera, points, board);
        sum += pose ? std::min(pose->rms, kFar) * std::min(pose->rms, kFar) : kFar * kFar;
      }
      if (sum < 0.999 * least) least = sum, best = camera;
    }
  if (!best || least >= 0.99 * kFar * kFar * static_cast<double>(boards.size()))
    throw InputError("found corners that no camera sees of such a target: is the pattern the right one?");
  return *best;
}

}  // namespace tankrig
