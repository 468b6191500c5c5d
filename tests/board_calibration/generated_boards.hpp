// Targets held before a known camera: their corners, with noise, and their pictures.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <random>

#include "calibration/boards/find_board.hpp"
#include "core/camera_model.hpp"

namespace tankrig {

inline CameraModel true_camera() { return {640, 480, 530, 560, 331, 246, -0.28, 0.09, 0.001, -0.0007, 0}; }

inline BoardTarget checkerboard(const std::string& pattern = "9x6") {
  return board_target(TargetKind::kCheckerboard, pattern, 0.03);
}

/// The target's middle `place` from the camera, turned by roll, pitch and yaw against facing it.
inline Transform held(const BoardTarget& target, const Vector3d& place, const Vector3d& roll_pitch_yaw) {
  const Transform cMmiddle = make_transform_rpy(place, roll_pitch_yaw);
  return cMmiddle * Eigen::Translation3d(-target.points().back() / 2);
}

/// Places all over the image, tilted by up to 40 degrees, with every corner in the picture.
inline std::vector<Transform> many_places(const CameraModel& camera, const BoardTarget& target, int count,
                                          std::mt19937_64& random, double most_tilt = 0.7) {
  std::uniform_real_distribution<double> share(-1, 1);
  std::vector<Transform> places;
  while (static_cast<int>(places.size()) < count) {
    const double distance = 0.5 + 0.15 * share(random);
    const Vector3d place(0.35 * distance * share(random), 0.28 * distance * share(random), distance);
    const Transform cMt =
        held(target, place, {most_tilt * share(random), most_tilt * share(random), 0.5 * share(random)});
    bool all = true;
    for (const Vector3d& p : target.points()) {
      const auto pixel = camera.project(cMt * p);
      all = all && pixel && camera.contains(*pixel);
    }
    if (all) places.push_back(cMt);
  }
  return places;
}

/// All over the image, 0.4 to 1.2 m off: only the change with distance tells a port from a lens.
inline std::vector<Transform> near_and_far(const CameraModel& camera, const BoardTarget& target, int count,
                                           std::mt19937_64& random) {
  std::uniform_real_distribution<double> share(-1, 1);
  std::vector<Transform> places;
  while (static_cast<int>(places.size()) < count) {
    const double distance = 0.4 * std::pow(3, 0.5 + 0.5 * share(random));
    const Vector3d place(0.35 * distance * share(random), 0.28 * distance * share(random), distance);
    const Transform cMt = held(target, place, {0.6 * share(random), 0.6 * share(random), 0.5 * share(random)});
    const std::vector<Vector3d> points = target.points();
    if (std::all_of(points.begin(), points.end(), [&](const Vector3d& p) {
          const auto pixel = camera.project(cMt * p);
          return pixel && camera.contains(*pixel);
        }))
      places.push_back(cMt);
  }
  return places;
}

inline FoundBoard corners_of(const CameraModel& camera, const BoardTarget& target, const Transform& cMt,
                             double noise_px, std::mt19937_64& random) {
  std::normal_distribution<double> noise(0, noise_px);
  FoundBoard board;
  for (const Vector3d& p : target.points()) {
    board.ids.push_back(static_cast<int>(board.ids.size()));
    board.pixels.push_back(camera.project(cMt * p).value() + Vector2d(noise(random), noise(random)));
  }
  board.smallest_spacing = 20;
  return board;
}

/// Brightness of the target's plane, 0 to 255, at a place on it [m].
using Print = std::function<double(double x, double y)>;

inline Print checkerboard_print(const BoardTarget& target) {
  return [=](double x, double y) {
    const double column = std::floor(x / target.spacing), row = std::floor(y / target.spacing);
    const bool board = column >= -1 && row >= -1 && column < target.columns && row < target.rows;
    const bool paper = column >= -2 && row >= -2 && column <= target.columns && row <= target.rows;
    if (!paper) return 110.0;
    return board && static_cast<int>(column + row + 4) % 2 == 0 ? 30.0 : 225.0;
  };
}

inline Print dots_print(const BoardTarget& target) {
  const std::vector<Vector3d> dots = target.points();
  const double radius = (target.kind == TargetKind::kAsymmetricDots ? 0.5 : 0.3) * target.spacing;
  return [=](double x, double y) {
    for (const Vector3d& dot : dots)
      if (std::hypot(x - dot.x(), y - dot.y()) < radius) return 30.0;
    return 225.0;
  };
}

/// A pixel's line of sight, in c.
using Sight = std::function<ViewingRay(double u, double v)>;

/// Sampled nine times in every pixel.
inline cv::Mat picture_of(cv::Size size, const Sight& sight, const Transform& cMt, const Print& print) {
  const Transform tMc = cMt.inverse();
  cv::Mat picture(size, CV_8UC1);
  for (int v = 0; v < size.height; ++v)
    for (int u = 0; u < size.width; ++u) {
      double sum = 0;
      for (const double dv : {-1 / 3.0, 0.0, 1 / 3.0})
        for (const double du : {-1 / 3.0, 0.0, 1 / 3.0}) {
          const ViewingRay ray = tMc * sight(u + du, v + dv);
          const Vector3d at = ray.at(-ray.origin.z() / ray.direction.z());
          sum += print(at.x(), at.y());
        }
      picture.at<uchar>(v, u) = static_cast<uchar>(std::lround(sum / 9));
    }
  return picture;
}
inline cv::Mat picture_of(const CameraModel& camera, const Transform& cMt, const Print& print) {
  return picture_of(
      {camera.width, camera.height}, [&](double u, double v) { return camera.sight(u, v); }, cMt, print);
}

}  // namespace tankrig
