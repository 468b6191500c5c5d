#include "calibration/object_pose/visp_poses.hpp"

#include <visp3/vision/vpPose.h>

#include "calibration/visp/visp_conversion.hpp"
#include "core/input_error.hpp"

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
  std::vector<Vector2d> rays;
  vpPose pose;
  for (std::size_t k = 0; k < points.size(); ++k) {
    rays.push_back(camera.normalized(pixels[k].x(), pixels[k].y()));
    vpPoint point(points[k].x(), points[k].y(), points[k].z());
    point.set_x(rays.back().x());
    point.set_y(rays.back().y());
    pose.addPoint(point);
  }
  pose.setRansacNbInliersToReachConsensus(static_cast<unsigned>(points.size()));
  pose.setRansacThreshold(kInlier_px / camera.fx);
  const std::pair<const char*, vpPose::vpPoseMethodType> methods[] = {
      {"LAGRANGE", vpPose::LAGRANGE},
      {"DEMENTHON", vpPose::DEMENTHON},
      {"LOWE", vpPose::LOWE},
      {"RANSAC", vpPose::RANSAC},
      {"LAGRANGE_LOWE", vpPose::LAGRANGE_LOWE},
      {"DEMENTHON_LOWE", vpPose::DEMENTHON_LOWE},
      {"VIRTUAL_VS", vpPose::VIRTUAL_VS},
      {"DEMENTHON_VIRTUAL_VS", vpPose::DEMENTHON_VIRTUAL_VS},
      {"LAGRANGE_VIRTUAL_VS", vpPose::LAGRANGE_VIRTUAL_VS}};
  std::vector<VispPose> out;
  for (const auto& [name, method] : methods) {
    VispPose found{name, "", Transform::Identity()};
    try {
      vpHomogeneousMatrix cMo = to_visp(rough_pose(points, rays));
      if (!pose.computePose(method, cMo)) throw InputError("ViSP found no consensus");
      found.cMo = from_visp(cMo);
      if (!found.cMo.translation().allFinite()) throw InputError("its answer is not finite");
    } catch (const vpException& e) {
      found.failure = "ViSP: " + std::string(e.getMessage());
    } catch (const InputError& e) {
      found.failure = e.what();
    }
    out.push_back(found);
  }
  return out;
}

}  // namespace tankrig
