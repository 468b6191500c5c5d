#include "calibration/laser_plane/checkerboard.hpp"

#include <fmt/format.h>

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <vector>

#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"

namespace tankrig {
namespace {

std::vector<cv::Point2f> corners_in(const cv::Mat& grey, const Checkerboard& board) {
  std::vector<cv::Point2f> corners;
  const int flags = cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_ACCURACY;
  if (!cv::findChessboardCornersSB(grey, {board.columns, board.rows}, corners, flags)) corners.clear();
  return corners;
}

template <class Pixels>
Transform pose_of(const std::vector<cv::Point3f>& object, const Pixels& pixels, const cv::Matx33d& matrix,
                  const cv::Mat& distortion) {
  cv::Vec3d rotation, translation;
  cv::solvePnP(object, pixels, matrix, distortion, rotation, translation, false, cv::SOLVEPNP_ITERATIVE);
  cv::Matx33d turn;
  cv::Rodrigues(rotation, turn);
  Eigen::Matrix3d linear;
  cv::cv2eigen(turn, linear);
  Transform cMt = Transform::Identity();
  cMt.linear() = linear;
  cMt.translation() = Vector3d(translation[0], translation[1], translation[2]);
  return cMt;
}

}  // namespace

Checkerboard checkerboard_of(const std::string& pattern, double square) {
  Checkerboard board{0, 0, square};
  const auto times = pattern.find('x');
  if (times == std::string::npos || !parse_number(pattern.substr(0, times), board.columns) ||
      !parse_number(pattern.substr(times + 1), board.rows) || board.columns < 3 || board.rows < 3 ||
      board.columns > 100 || board.rows > 100)
    throw InputError("--pattern: found '" + shown_text(pattern) +
                     "', expected COLUMNSxROWS of inner corners, 3x3 to 100x100");
  return board;
}

std::optional<CheckerboardView> find_checkerboard(const cv::Mat& picture, const Checkerboard& board,
                                                  const CameraModel& camera) {
  if (picture.cols != camera.width || picture.rows != camera.height)
    throw InputError(fmt::format("checkerboard: found a picture of {}x{} px, expected the camera's {}x{}", picture.cols,
                                 picture.rows, camera.width, camera.height));
  // A laser's green or blue line is weakest in red.
  cv::Mat grey = picture;
  if (picture.channels() == 3) cv::extractChannel(picture, grey, 2);
  std::vector<cv::Point2f> corners = corners_in(grey, board);
  if (corners.empty() && picture.channels() == 3) {
    cv::extractChannel(picture, grey, 1);
    corners = corners_in(grey, board);
  }
  if (corners.empty()) return std::nullopt;
  std::vector<cv::Point3f> object;
  for (int row = 0; row < board.rows; ++row)
    for (int column = 0; column < board.columns; ++column)
      object.emplace_back(static_cast<float>(column * board.square), static_cast<float>(row * board.square), 0.0f);
  CheckerboardView view;
  view.cMt = pose_of(object, corners, camera.matrix(), camera.distortion());
  // Behind a port: by the rays of a pinhole in c's origin, at the depths of the pose before.
  for (int round = 0; round < kPortRounds && camera.port; ++round) {
    std::vector<cv::Point2d> rays;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const double depth = round == 0 ? 1 : (view.cMt * Vector3d(object[i].x, object[i].y, 0)).z();
      const Vector2d ray = camera.normalized(corners[i].x, corners[i].y, depth);
      rays.emplace_back(ray.x(), ray.y());
    }
    view.cMt = pose_of(object, rays, cv::Matx33d::eye(), {});
  }
  for (std::size_t i = 0; i < corners.size(); ++i) {
    view.points.emplace_back(object[i].x, object[i].y, 0);
    view.corners.emplace_back(corners[i].x, corners[i].y);
    const auto again = camera.project(view.cMt * view.points.back());
    if (!again) return std::nullopt;  // behind the camera
    view.rms += (*again - view.corners.back()).squaredNorm() / static_cast<double>(corners.size());
  }
  view.rms = std::sqrt(view.rms);
  return view;
}

BoardArea area_of(const Checkerboard& board) {
  const Vector2d more = Vector2d::Constant(0.9 * board.square);
  return {-more, more + board.square * Vector2d(board.columns - 1, board.rows - 1)};
}

}  // namespace tankrig
