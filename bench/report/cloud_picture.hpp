// The paper's picture: the cloud in its colours over the object it should lie on.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "bench/metrics/metrics.hpp"
#include "bench/report/canvas.hpp"

namespace tankrig {

struct CloudPictureOptions {
  int width = 900, height = 640;
  Viewpoint view;
  std::string title;
};

/// From behind, the left and above. For an object that stands on its -z side.
Viewpoint back_view();

/// From where the camera is, `camera_o` in the object's frame, towards the object's middle.
Viewpoint view_from(const Vector3d& camera_o, const TriangleMesh& mesh);

/// Ground black, object green, outliers blue, points between the thresholds grey; the object in light grey with its
/// edges. Points far beyond the object's surroundings fall off the sheet; the legend counts them all.
/// Frames: `cloud` and `mesh` in o. `verdicts` has one entry per point.
/// Errors: InputError if it has not.
cv::Mat draw_cloud_over_object(const PointCloud& cloud, const std::vector<PointVerdict>& verdicts,
                               const TriangleMesh& mesh, const CloudPictureOptions& options);

}  // namespace tankrig
