#include "calibration/object_pose/visp_poses.hpp"

namespace tankrig {
namespace {

constexpr double kInlier_px = 4;  // of ViSP's RANSAC

/// At the distance at which the object would be as large as it looks.
Transform rough_pose(const std::vector<Vector3d>& points, const std::vector<Vector2d>& rays) {
  Eigen::AlignedBox3d object;
  Eigen::AlignedBox2d seen;
  for (const Vector3d& p : points) object.extend(p);
  for (const Vector2d& r : rays) seen.extend(r);
  const double distance = object.diagonal().norm() / seen.diagonal().norm();
  Transform cMo = Transform::Identity();
  cMo.linear() = Eigen::AngleAxisd(1e-3, Vector3d(1, 1, 1).normalized()).toRotationMatrix();
  cMo.translation() = distance * seen.center().homogeneous() - object.center();
  return cMo;
}

}  // namespace

std::vector<VispPose> visp_poses(const CameraModel& camera, const std::vector<Vector3d>& points,
                                 const std::vector<Vector2d>& pixels) {
  const auto rays_at = [&](double depth) {
    std::vector<Vector2d> rays;
    for (const Vector2d& pixel : pixels) rays.push_back(camera.normalized(pixel.x(), pixel.y(), depth));
    return rays;
  };
  // Behind a port the rays are those at the object's distance: a start, whose end is exact.
  constexpr double kTypicalDepth = 1;  // [m]
  const std::vector<Vector2d> rays = rays_at(rough_pose(points, rays_at(kTypicalDepth)).translation().z());
  return visp().poses(points, rays, kInlier_px / camera.fx, rough_pose(points, rays));
}

}  // namespace tankrig
