#include "apps/tankrig/calibrate/object_picture.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace tankrig::app {

cv::Mat object_picture(const cv::Mat& picture, const ObjectPoseProblem& problem, const SnappedPose& pose) {
  constexpr int kShift = 4;  // sixteenths of a pixel
  cv::Mat out = picture.clone();
  const auto point = [](const Vector2d& p) {
    return cv::Point(static_cast<int>(std::lround(16 * p.x())), static_cast<int>(std::lround(16 * p.y())));
  };
  const Vector3d eye = pose.snapped.cMo.inverse().translation();
  for (const ObjectShape::Edge& edge : problem.shape.edges()) {
    if (!problem.shape.sees(eye, (edge.a + edge.b) / 2)) continue;
    constexpr int kParts = 16;  // a lens bends edges
    for (int k = 0; k < kParts; ++k) {
      const auto at = [&](int part) {
        return problem.camera.project(pose.snapped.cMo * Vector3d(edge.a + (edge.b - edge.a) * part / kParts));
      };
      const auto a = at(k), b = at(k + 1);
      if (a && b) cv::line(out, point(*a), point(*b), {0, 200, 255}, 1, cv::LINE_AA, kShift);
    }
  }
  for (std::size_t k = 0; k < problem.corners.size(); ++k) {
    cv::drawMarker(out,
                   {static_cast<int>(std::lround(problem.corners[k].pixel.x())),
                    static_cast<int>(std::lround(problem.corners[k].pixel.y()))},
                   {0, 0, 255}, cv::MARKER_TILTED_CROSS, 11, 1, cv::LINE_AA);
    if (!pose.corners.empty() && pose.corners[k].why_not.empty())
      cv::circle(out, point(pose.corners[k].corner.pixel), 16 * 5, {0, 255, 0}, 1, cv::LINE_AA, kShift);
  }
  return out;
}

}  // namespace tankrig::app
