#include "calibration/marker/marker.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "calibration/marker/dots.hpp"
#include "calibration/marker/square_corners.hpp"
#include "calibration/visp/visp_methods.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr double kFlipMayFit = 6;  // times the better pose's error: beyond it the other one is none
constexpr double kFlipMayFit_px = 2;

struct Dictionary {
  const char* name;
  int opencv;
  std::optional<AprilTagFamily> visp;
};
const Dictionary kDictionaries[] = {
    {"4x4_50", cv::aruco::DICT_4X4_50, {}},
    {"4x4_250", cv::aruco::DICT_4X4_250, {}},
    {"5x5_50", cv::aruco::DICT_5X5_50, {}},
    {"5x5_250", cv::aruco::DICT_5X5_250, {}},
    {"6x6_50", cv::aruco::DICT_6X6_50, {}},
    {"6x6_250", cv::aruco::DICT_6X6_250, {}},
    {"aruco_original", cv::aruco::DICT_ARUCO_ORIGINAL, {}},
    {"apriltag_16h5", cv::aruco::DICT_APRILTAG_16h5, AprilTagFamily::k16h5},
    {"apriltag_25h9", cv::aruco::DICT_APRILTAG_25h9, AprilTagFamily::k25h9},
    {"apriltag_36h11", cv::aruco::DICT_APRILTAG_36h11, AprilTagFamily::k36h11},
};

const Dictionary& dictionary_of(const GripperMarker& marker) {
  std::vector<std::string> names;
  for (const Dictionary& d : kDictionaries) {
    if (marker.dictionary == d.name) return d;
    names.emplace_back(d.name);
  }
  throw InputError(fmt::format("marker: found dictionary '{}', expected one of: {}", shown_text(marker.dictionary),
                               fmt::join(names, ", ")));
}

using Corners = std::vector<cv::Point2f>;

/// Where ViSP's list of a tag's corners has the printed marker's top left one and those that follow clockwise. ViSP and OpenCV do
/// not agree on which side of an AprilTag is up: asked of a tag that OpenCV draws.
std::array<std::size_t, 4> visp_order(const Dictionary& dictionary) {
  constexpr int kSide = 200, kMargin = 60;
  cv::Mat tag, sheet(kSide + 2 * kMargin, kSide + 2 * kMargin, CV_8U, cv::Scalar(255));
  cv::aruco::getPredefinedDictionary(dictionary.opencv)->drawMarker(0, kSide, tag, 1);
  tag.copyTo(sheet(cv::Rect(kMargin, kMargin, kSide, kSide)));
  const std::vector<VispTag> found = visp().tags(sheet, *dictionary.visp);
  if (found.size() != 1)
    throw InputError(fmt::format("marker: ViSP does not know the tags of {} that OpenCV draws", dictionary.name));
  std::array<std::size_t, 4> order{};
  constexpr int kFar = kMargin + kSide;
  const cv::Point printed[] = {{kMargin, kMargin}, {kFar, kMargin}, {kFar, kFar}, {kMargin, kFar}};
  for (std::size_t k = 0; k < 4; ++k)
    for (std::size_t other = 0; other < 4; ++other)
      if (std::hypot(found[0].corners[other].x() - printed[k].x, found[0].corners[other].y() - printed[k].y) <
          kSide / 4)
        order[k] = other;
  return order;
}

/// By id. A marker that is seen twice is none: one of the two is a mistake.
std::map<int, Corners> markers_in(const cv::Mat& grey, const Dictionary& dictionary) {
  std::map<int, Corners> found;
  std::map<int, int> times;
  if (dictionary.visp) {
    const auto order = visp_order(dictionary);
    for (const VispTag& tag : visp().tags(grey, *dictionary.visp)) {
      Corners& marker = found[tag.id];
      ++times[tag.id];
      marker.clear();
      for (const std::size_t corner : order)
        marker.emplace_back(static_cast<float>(tag.corners[corner].x()), static_cast<float>(tag.corners[corner].y()));
    }
  } else {
    std::vector<Corners> corners;
    std::vector<int> ids;
    cv::aruco::detectMarkers(grey, cv::aruco::getPredefinedDictionary(dictionary.opencv), corners, ids);
    for (std::size_t k = 0; k < ids.size(); ++k) found[ids[k]] = corners[k], ++times[ids[k]];
  }
  std::erase_if(found, [&](const auto& entry) { return times[entry.first] > 1; });
  return found;
}

void check(const ConfigNode& node, const GripperMarker& marker) {
  if (marker.pattern == MarkerPattern::kDots) {
    if (marker.dots.size() < 10 || marker.dots.size() % 2 != 0 || marker.dots.size() > 32)
      node.fail("dots_m", fmt::format("found {} numbers, expected x and y of 5 to 16 dots", marker.dots.size()));
    return;
  }
  if (marker.marker > marker.pitch)
    node.fail("marker_m", fmt::format("found {}, expected at most the pitch {}", marker.marker, marker.pitch));
}

using Marker = GripperMarker;
const Setting<Marker> kMarkerRows[] = {
    {"pattern", &Marker::pattern, "what the plate shows", Need::kRequired},
    {"columns", &Marker::columns, ConfigRange(1, 20), "markers in a row"},
    {"rows", &Marker::rows, ConfigRange(1, 20), "rows of markers"},
    {"pitch_m", &Marker::pitch, ConfigRange(0.002, 1), "from one marker to the next"},
    {"marker_m", &Marker::marker, ConfigRange(0.002, 1), "side of a marker with its black frame"},
    {"dictionary", &Marker::dictionary, "of the markers: 4x4_50, 6x6_250, apriltag_36h11, ..."},
    {"first_id", &Marker::first_id, ConfigRange(0, 2000), "number of the first marker"},
    {"dots_m", &Marker::dots,
     "x, y of each dot's centre, one after another; no turn may make the layout look the same"},
};

}  // namespace

constinit const SettingsTable<GripperMarker> kGripperMarkerKeys{kMarkerRows, check};

std::vector<Vector3d> points_of(const GripperMarker& m) {
  std::vector<Vector3d> points;
  if (m.pattern == MarkerPattern::kDots) {
    for (std::size_t k = 0; k + 1 < m.dots.size(); k += 2) points.emplace_back(m.dots[k], m.dots[k + 1], 0);
    return points;
  }
  const double gap = (m.pitch - m.marker) / 2;
  for (int row = 0; row < m.rows; ++row)
    for (int column = 0; column < m.columns; ++column) {
      const Vector3d first(column * m.pitch + gap, row * m.pitch + gap, 0);
      for (const Vector3d& corner : {Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(1, 1, 0), Vector3d(0, 1, 0)})
        points.push_back(first + m.marker * corner);
    }
  return points;
}

MarkerFinder::MarkerFinder(const GripperMarker& marker) : marker_(marker) {
  if (marker.pattern == MarkerPattern::kDots)
    check_layout(points_of(marker));
  else
    dictionary_of(marker);
}

SeenMarker MarkerFinder::find(const cv::Mat& grey) const {
  const std::vector<Vector3d> points = points_of(marker_);
  if (marker_.pattern == MarkerPattern::kDots) return {points, find_dots(grey, points)};
  SeenMarker seen;
  for (auto& [id, corners] : markers_in(grey, dictionary_of(marker_))) {
    const int number = id - marker_.first_id;
    if (number < 0 || number >= marker_.columns * marker_.rows) continue;
    Corners refined = corners;
    refine_square_corners(grey, refined);
    for (std::size_t k = 0; k < 4; ++k) {
      seen.points.push_back(points[4 * static_cast<std::size_t>(number) + k]);
      seen.corners.emplace_back(refined[k].x, refined[k].y);
    }
  }
  return seen;
}

namespace {

/// By the rays of a pinhole in c's origin, which behind a port depend on the points' depths.
std::optional<PlanarPose> pose_at(const CameraModel& camera, const SeenMarker& seen,
                                  const std::vector<double>& depths) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> rays;
  for (std::size_t k = 0; k < seen.points.size(); ++k) {
    points.emplace_back(seen.points[k].x(), seen.points[k].y(), seen.points[k].z());
    const Vector2d ray = camera.normalized(seen.corners[k].x(), seen.corners[k].y(), depths[k]);
    rays.emplace_back(ray.x(), ray.y());
  }
  std::vector<cv::Mat> turns, places;
  cv::solvePnPGeneric(points, rays, cv::Matx33d::eye(), cv::noArray(), turns, places, false, cv::SOLVEPNP_IPPE);
  std::vector<std::pair<double, Transform>> poses;
  for (std::size_t k = 0; k < turns.size(); ++k) {
    const Vector3d turn(turns[k].at<double>(0), turns[k].at<double>(1), turns[k].at<double>(2));
    Transform cMg = Transform::Identity();
    if (turn.norm() > 0) cMg.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
    cMg.translation() = Vector3d(places[k].at<double>(0), places[k].at<double>(1), places[k].at<double>(2));
    double squares = 0;
    for (std::size_t i = 0; i < seen.points.size(); ++i) {
      const auto pixel = camera.project(cMg * seen.points[i]);
      squares += pixel ? (*pixel - seen.corners[i]).squaredNorm() : std::numeric_limits<double>::infinity();
    }
    const double rms = std::sqrt(squares / static_cast<double>(seen.points.size()));
    if (std::isfinite(rms)) poses.emplace_back(rms, cMg);
  }
  if (poses.empty()) return std::nullopt;
  std::sort(poses.begin(), poses.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  PlanarPose best{poses[0].second, poses[0].first, {}};
  if (poses.size() > 1 && poses[1].first < std::max(kFlipMayFit * best.rms_px, kFlipMayFit_px))
    best.flipped = poses[1].second;
  return best;
}

}  // namespace

std::optional<PlanarPose> planar_pose(const CameraModel& camera, const SeenMarker& seen) {
  std::vector<double> depths(seen.points.size(), 1);
  std::optional<PlanarPose> pose = pose_at(camera, seen, depths);
  for (int round = 1; round < kPortRounds && camera.port && pose; ++round) {
    for (std::size_t k = 0; k < depths.size(); ++k) depths[k] = (pose->cMg * seen.points[k]).z();
    pose = pose_at(camera, seen, depths);
  }
  return pose;
}

}  // namespace tankrig
