// The clouds of a report for its 3D view: the data that bench/report/web/cloud_view.ts draws.
#pragma once

#include <string>
#include <vector>

#include "bench/metrics/metrics.hpp"
#include "bench/metrics/triangle_mesh.hpp"

namespace tankrig {

/// Frame: o.
struct ViewedCloud {
  std::string name;
  PointCloud cloud;
  std::vector<PointVerdict> verdicts;  ///< one for each of its points
};

/// A polyline: an arm, or what a camera sees. Frame: o.
struct ViewedLines {
  std::string name;  ///< "arm", or the camera's
  std::vector<Vector3d> points;
};

/// Corners of a camera's pyramid, as one line. `oMc`: the camera in o.
ViewedLines camera_pyramid(const std::string& name, const CameraModel& model, const Transform& oMc);

/// script_json(). A cloud is evenly thinned to at most 40 000 points, with
/// coordinates rounded to 1/32767 of the largest.
std::string cloud_view_json(const TriangleMesh& object, const std::vector<ViewedCloud>& clouds,
                            const std::vector<ViewedLines>& rig);

/// The part of a page that shows it, a mustache template: `cloud_view` has `data` and `program`.
extern const char* const kViewTemplate;

}  // namespace tankrig
