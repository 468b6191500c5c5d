// What ViSP does for the solvers, in our types. ViSP brings two hundred libraries: it is loaded when it is first asked.
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/frames.hpp"

namespace tankrig {

/// An answer of one of its methods.
struct VispPose {
  std::string name;
  std::string failure;  ///< empty: an answer
  Transform pose = Transform::Identity();
};

enum class AprilTagFamily { k16h5, k25h9, k36h11 };

struct VispTag {
  int id = 0;
  std::array<Vector2d, 4> corners;  ///< in ViSP's order [px]
};

/// Pictures are of 8 bits and one channel.
struct VispMethods {
  /// eMc of a camera in the gripper that sees cMo while the arm is at rMe. What ViSP prints is swallowed.
  /// Threads: one at a time.
  VispPose (*hand_eye)(const std::vector<Transform>& cMo, const std::vector<Transform>& rMe);
  /// cMo of points in o that are seen along `rays` (z = 1), by every method that ViSP has, in a fixed order. Those that need a start begin
  /// at `start`. `inlier`: largest distance from a ray for RANSAC.
  std::vector<VispPose> (*poses)(const std::vector<Vector3d>& points, const std::vector<Vector2d>& rays, double inlier,
                                 const Transform& start);
  /// Centres of the dots that ViSP finds from points inside them, in that order [px].
  std::vector<Vector2d> (*dots)(const cv::Mat& grey, const std::vector<cv::Point>& inside);
  std::vector<VispTag> (*tags)(const cv::Mat& grey, AprilTagFamily family);
};

/// Errors: InputError if it cannot be loaded.
const VispMethods& visp();

}  // namespace tankrig
