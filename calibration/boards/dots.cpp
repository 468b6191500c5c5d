// A grid of dots found in a picture.

#include <fmt/core.h>

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>

#include "calibration/boards/board_grid.hpp"

namespace tankrig {
namespace {

cv::Ptr<cv::SimpleBlobDetector> blob_detector(const cv::Mat& grey, int colour) {
  cv::SimpleBlobDetector::Params params;
  params.filterByColor = true;
  params.blobColor = static_cast<uchar>(colour);
  params.minArea = 12;
  params.maxArea = static_cast<float>(grey.total()) / 16;
  params.minDistBetweenBlobs = 4;
  return cv::SimpleBlobDetector::create(params);
}

/// Whether most places one step beyond a side of the grid have a blob.
bool goes_on(const BoardTarget& target, const BoardGrid& grid, const cv::Matx33d& H,
             const std::vector<cv::KeyPoint>& blobs, const cv::Size& size) {
  if (target.kind != TargetKind::kDots) return false;
  const auto side_goes_on = [&](int count, auto beyond) {
    int tested = 0, there = 0;
    for (int i = 0; i < count; ++i) {
      const cv::Point2d p = beyond(i);
      if (!(p.x >= 0 && p.y >= 0 && p.x < size.width && p.y < size.height)) continue;
      ++tested;
      there += std::any_of(blobs.begin(), blobs.end(), [&](const cv::KeyPoint& blob) {
        return cv::norm(cv::Point2d(blob.pt) - p) < 0.25 * grid.smallest_spacing();
      });
    }
    return tested >= 2 && there > 0.6 * tested;
  };
  return side_goes_on(grid.columns, [&](int i) { return place(H, i, -1); }) ||
         side_goes_on(grid.columns, [&](int i) { return place(H, i, grid.rows); }) ||
         side_goes_on(grid.rows, [&](int i) { return place(H, -1, i); }) ||
         side_goes_on(grid.rows, [&](int i) { return place(H, grid.columns, i); });
}

}  // namespace

BoardSearch find_dots(const cv::Mat& grey, const BoardTarget& target) {
  const bool asymmetric = target.kind == TargetKind::kAsymmetricDots;
  const int grid_flag = asymmetric ? cv::CALIB_CB_ASYMMETRIC_GRID : cv::CALIB_CB_SYMMETRIC_GRID;
  const std::string expected = fmt::format("expected {} x {} dots", target.columns, target.rows);
  std::size_t most = 0;
  for (const int colour : {0, 255}) {
    const cv::Ptr<cv::SimpleBlobDetector> detector = blob_detector(grey, colour);
    std::vector<cv::KeyPoint> blobs;
    detector->detect(grey, blobs);
    most = std::max(most, blobs.size());
    if (blobs.size() < target.size()) continue;
    for (const int way : {0, int(cv::CALIB_CB_CLUSTERING)}) {
      BoardGrid grid{target.columns, target.rows, {}};
      if (!cv::findCirclesGrid(grey, {target.columns, target.rows}, grid.points, grid_flag | way, detector)) continue;
      if (asymmetric) {
        const cv::Point2f x = grid.at(0, grid.columns - 1) - grid.at(0, 0),
                          y = grid.at(grid.rows - 1, 0) - grid.at(0, 0);
        if (x.cross(y) < 0) return {{}, "found the dots mirrored, " + expected + " seen from the front"};
        return found(grid);
      }
      grid.face_front();
      const auto H = grid.homography();
      if (!H) return {{}, "found dots that lie on no plane, " + expected};
      if (goes_on(target, grid, *H, blobs, grey.size()))
        return {
            {},
            fmt::format("found a grid that goes on beyond {} x {} dots, {}", target.columns, target.rows, expected)};
      return found(grid);
    }
  }
  return {
      {},
      fmt::format("found {} dots in no such grid, {}: part of it is out of the picture or covered, or it is another",
                  most, expected)};
}

}  // namespace tankrig
