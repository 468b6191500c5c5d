// The marker in the gripper: a grid of AprilTag or ArUco markers, or the paper's flat pattern of dots, and where a picture shows it.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/camera_model.hpp"
#include "core/settings_table.hpp"

namespace tankrig {

enum class MarkerPattern { kMarkers, kDots };
template <>
inline constexpr std::array kNames<MarkerPattern>{"markers", "dots"};

/// Frames: g. Markers: origin at the outer corner of the first square of the grid, x along the first row, y down, z into the
/// plate. Dots: as their list has it, z = 0.
struct GripperMarker {
  MarkerPattern pattern = MarkerPattern::kMarkers;
  int columns = 1, rows = 1;
  double pitch = 0.06;   ///< from one marker to the next [m]
  double marker = 0.05;  ///< side of a marker with its black frame, in the middle of its square [m]
  std::string dictionary = "apriltag_36h11";
  int first_id = 0;
  std::vector<double> dots;  ///< x, y of each dot's centre, one after another [m]
};

extern const SettingsTable<GripperMarker> kGripperMarkerKeys;

/// All of its points, marker by marker, from the top left corner clockwise as printed; or the dots.
std::vector<Vector3d> points_of(const GripperMarker& marker);

/// What a picture shows of it, point by point.
/// Units: pixels, metres.
struct SeenMarker {
  std::vector<Vector3d> points;   ///< in g
  std::vector<Vector2d> corners;  ///< in the picture
};

/// AprilTags by ViSP, ArUco markers by OpenCV, their corners where their sides meet; dots by ViSP, told apart by the homography that
/// fits all of them.
/// Threads: any.
class MarkerFinder {
 public:
  /// Errors: InputError: a dictionary nobody knows, dots whose layout looks the same after a turn.
  explicit MarkerFinder(const GripperMarker& marker);

  /// Empty where the picture does not show it. `grey`: 8 bits, one channel.
  SeenMarker find(const cv::Mat& grey) const;

 private:
  GripperMarker marker_;
};

/// The poses cMg of a flat marker that its corners allow: the better one, and the other where it fits nearly as well.
struct PlanarPose {
  Transform cMg = Transform::Identity();
  double rms_px = 0;
  std::optional<Transform> flipped;
};

/// Nothing if the corners allow none.
std::optional<PlanarPose> planar_pose(const CameraModel& camera, const SeenMarker& seen);

}  // namespace tankrig
