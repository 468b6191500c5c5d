// Before a scan: which faces of the object the camera will see and the sheet will light, and how steeply.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "rig/config/rig_config.hpp"
#include "rig/plan/scan_plan.hpp"

namespace tankrig::app {

/// One planar face of the object's mesh.
struct FaceView {
  Vector3d normal_o = Vector3d::Zero();
  double area_share = 0;        ///< of the whole surface
  double seen = 0, lit = 0;     ///< shares of the face turned to the camera, and passed by the sheet from its front
  double camera_incidence = 0;  ///< worst over the seen part [rad]
  double laser_incidence = 0;   ///< worst over the lit part [rad]
};

struct SurfaceView {
  std::vector<FaceView> faces;  ///< by falling area
  std::string table() const;
  nlohmann::json json() const;
};

/// Planar faces larger than 2 % of the surface; incidence from the mono camera and from the projector as `plan` moves
/// it. Self-occlusion is left to the ceiling: for a convex object there is none.
SurfaceView surface_view(const RigConfig& rig, const ScanPlan& plan);

}  // namespace tankrig::app
