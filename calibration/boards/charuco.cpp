// A ChArUco board found in a picture.

#include <fmt/core.h>

#include <algorithm>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>

#include "calibration/boards/board_grid.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kFewestMarkers = 4, kFewestCorners = 6;

struct Markers {
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
};

Markers find_markers(const cv::Mat& grey, const cv::Ptr<cv::aruco::CharucoBoard>& board) {
  Markers markers;
  cv::aruco::detectMarkers(grey, board->dictionary, markers.corners, markers.ids);
  return markers;
}

}  // namespace

BoardSearch find_charuco(const cv::Mat& grey, const BoardTarget& target) {
  const auto board = cv::aruco::CharucoBoard::create(
      target.columns + 1, target.rows + 1, static_cast<float>(target.spacing), static_cast<float>(target.marker),
      cv::aruco::getPredefinedDictionary(target.dictionary));
  const std::string expected = fmt::format("expected {} x {} corners", target.columns, target.rows);
  Markers markers = find_markers(grey, board);
  if (markers.ids.size() < kFewestMarkers) {
    cv::Mat mirrored;
    cv::flip(grey, mirrored, 1);
    if (find_markers(mirrored, board).ids.size() >= kFewestMarkers)
      return {{}, "found the markers mirrored: the picture is mirrored, expected one as the eye sees the board"};
    return {
        {},
        fmt::format("found {} markers of the dictionary, expected {} and more", markers.ids.size(), kFewestMarkers)};
  }
  const auto foreign = std::count_if(markers.ids.begin(), markers.ids.end(),
                                     [&](int id) { return id >= static_cast<int>(board->ids.size()); });
  if (foreign > 0)
    return {{},
            fmt::format("found {} markers that a board of {} x {} corners does not have: another board", foreign,
                        target.columns, target.rows)};
  std::vector<cv::Point2f> corners;
  std::vector<int> ids;
  cv::aruco::interpolateCornersCharuco(markers.corners, markers.ids, grey, board, corners, ids);
  std::vector<cv::Point2f> places;
  for (const int id : ids) places.emplace_back(float(id % target.columns), float(id / target.columns));
  const cv::Mat H = ids.size() >= 4 ? cv::findHomography(places, corners, 0) : cv::Mat();
  if (ids.size() < kFewestCorners || H.empty())
    return {
        {},
        fmt::format("found {} corners, {} or at least {} of them: half seen", ids.size(), expected, kFewestCorners)};

  // Each corner's side of a square, by the plane; and whether the corner lies where the plane has it.
  const cv::Matx33d plane(H);
  std::vector<double> nearest;
  double smallest = 1e9;
  std::size_t astray = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const cv::Point2d here = place(plane, places[i].x, places[i].y);
    nearest.push_back(std::min(cv::norm(place(plane, places[i].x + 1, places[i].y) - here),
                               cv::norm(place(plane, places[i].x, places[i].y + 1) - here)));
    smallest = std::min(smallest, nearest.back());
    astray += cv::norm(here - cv::Point2d(corners[i])) > 0.5 * nearest.back() ? 1 : 0;
  }
  if (2 * astray > ids.size() || !(smallest > 0))
    return {{},
            fmt::format("found markers that do not lie as on a board of {} x {} corners: another board", target.columns,
                        target.rows)};
  // No window may reach a marker: it begins at half of what a square has more than a marker.
  const double reach = std::min(1.0, 3.6 * (1 - target.marker / target.spacing) / 2);
  std::vector<double> windows = nearest;
  for (double& window : windows) window *= reach;
  refine_corners(grey, windows, corners);
  FoundBoard found_board;
  found_board.smallest_spacing = smallest;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const cv::Point2d here = place(plane, places[i].x, places[i].y);
    if (cv::norm(here - cv::Point2d(corners[i])) > 0.5 * nearest[i]) continue;
    found_board.ids.push_back(ids[i]);
    found_board.pixels.emplace_back(corners[i].x, corners[i].y);
  }
  return {std::move(found_board), {}};
}

}  // namespace tankrig
