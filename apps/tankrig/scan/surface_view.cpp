#include "apps/tankrig/scan/surface_view.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bench/metrics/surface_samples.hpp"
#include "core/angles.hpp"

namespace tankrig::app {
namespace {

/// Sheet and projector in o at one time of the sweep.
struct SheetPose {
  Plane oPl;
  Vector3d origin, direction;
};

std::vector<std::vector<SheetPose>> sheet_poses(const RigConfig& rig, const ScanPlan& plan) {
  const Transform oMb = rig.object.bMo.inverse();
  std::vector<std::vector<SheetPose>> passes;
  for (const Segment& segment : plan.segments()) {
    if (segment.phase != Phase::kSweep || !(segment.record_end > segment.record_begin)) continue;
    passes.emplace_back();
    for (double t = segment.record_begin; t <= segment.record_end; t += rig.scan.capture.frame_period) {
      const Transform oMe = oMb * rig.arm.bMe(plan.at(t).q);
      passes.back().push_back({oMe * rig.laser.ePl, oMe * rig.laser.origin_e, oMe.linear() * rig.laser.direction_e});
    }
  }
  return passes;
}

/// Angle between the surface normal and the direction from `p` to `viewer` [rad].
double incidence(const Vector3d& p, const Vector3d& normal, const Vector3d& viewer) {
  return std::acos(std::clamp((viewer - p).normalized().dot(normal), -1.0, 1.0));
}

/// Steepest angle at which the sheet passes over `p`; nothing if it never does.
std::optional<double> lit_incidence(const Vector3d& p, const Vector3d& normal, double half_fan,
                                    const std::vector<std::vector<SheetPose>>& passes) {
  std::optional<double> best;
  for (const auto& pass : passes)
    for (std::size_t i = 1; i < pass.size(); ++i) {
      if ((pass[i - 1].oPl.distance(p) > 0) == (pass[i].oPl.distance(p) > 0)) continue;
      const SheetPose& pose = pass[i];
      if ((p - pose.origin).normalized().dot(pose.direction) < std::cos(half_fan)) continue;
      const double angle = incidence(p, normal, pose.origin);
      if (angle < std::numbers::pi / 2) best = std::min(best.value_or(angle), angle);
    }
  return best;
}

}  // namespace

SurfaceView surface_view(const RigConfig& rig, const ScanPlan& plan) {
  SurfaceView view;
  const RigCamera* camera = rig.find_camera(CameraRole::kMono);
  if (!camera) return view;
  const Vector3d eye = (rig.object.bMo.inverse() * camera->bMc).translation();
  const auto passes = sheet_poses(rig, plan);
  const TriangleMesh mesh = read_mesh(rig.object.mesh);
  for (const SurfaceSample& sample : sample_surface(mesh, 4000)) {
    const Eigen::Vector3i& t = mesh.triangles[sample.triangle];
    const Vector3d normal =
        (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]).normalized();
    auto face = std::find_if(view.faces.begin(), view.faces.end(),
                             [&](const FaceView& f) { return f.normal_o.dot(normal) > 0.9999; });
    if (face == view.faces.end()) face = view.faces.insert(view.faces.end(), FaceView{normal});
    face->area_share += sample.weight;
    const double seen_at = incidence(sample.p, normal, eye);
    if (seen_at < std::numbers::pi / 2) {
      face->seen += sample.weight;
      face->camera_incidence = std::max(face->camera_incidence, seen_at);
    }
    if (const auto lit_at = lit_incidence(sample.p, normal, rig.laser.fan / 2, passes)) {
      face->lit += sample.weight;
      face->laser_incidence = std::max(face->laser_incidence, *lit_at);
    }
  }
  for (FaceView& face : view.faces) {
    face.seen /= face.area_share;
    face.lit /= face.area_share;
  }
  std::erase_if(view.faces, [](const FaceView& f) { return f.area_share < 0.02; });
  std::sort(view.faces.begin(), view.faces.end(),
            [](const FaceView& a, const FaceView& b) { return a.area_share > b.area_share; });
  return view;
}

std::string SurfaceView::table() const {
  std::string out = "face (normal in o)        area      seen      lit   worst incidence: camera, laser\n";
  int good = 0;
  for (const FaceView& f : faces) {
    out += fmt::format("({:5.2f} {:5.2f} {:5.2f})     {:5.1f} %   {:5.1f} %  {:5.1f} %   {:5.1f} deg  {:5.1f} deg\n",
                       f.normal_o.x(), f.normal_o.y(), f.normal_o.z(), 100 * f.area_share, 100 * f.seen, 100 * f.lit,
                       to_degrees(f.camera_incidence), to_degrees(f.laser_incidence));
    if (f.seen > 0.99 && f.lit > 0.99 && to_degrees(f.camera_incidence) <= 70 && to_degrees(f.laser_incidence) <= 70)
      ++good;
  }
  return out + std::to_string(good) + " faces wholly seen and lit at no more than 70 degrees\n";
}

nlohmann::json SurfaceView::json() const {
  nlohmann::json out = nlohmann::json::array();
  for (const FaceView& f : faces)
    out.push_back({{"normal_o", {f.normal_o.x(), f.normal_o.y(), f.normal_o.z()}},
                   {"area_share", f.area_share},
                   {"seen", f.seen},
                   {"lit", f.lit},
                   {"camera_incidence_deg", to_degrees(f.camera_incidence)},
                   {"laser_incidence_deg", to_degrees(f.laser_incidence)}});
  return out;
}

}  // namespace tankrig::app
