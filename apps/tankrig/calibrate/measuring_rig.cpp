#include "apps/tankrig/calibrate/measuring_rig.hpp"

#include "bench/metrics/surface_samples.hpp"
#include "bench/metrics/triangle_mesh.hpp"

namespace tankrig::app {
namespace {

BudgetCamera camera_of(const RigCamera& camera) { return {camera.name, camera.model, camera.bMc}; }

}  // namespace

BudgetSweep sweep_of(const RigConfig& rig) {
  return {rig.scan.posture, rig.scan.sweep.from, rig.scan.sweep.to, rig.scan.sweep.velocity};
}

MeasuringRig measuring_rig(const RigConfig& rig) {
  MeasuringRig measuring;
  measuring.mono = camera_of(*rig.find_camera(CameraRole::kMono));
  const RigCamera *left = rig.find_camera(CameraRole::kLeft), *right = rig.find_camera(CameraRole::kRight);
  if (left && right) measuring.left = camera_of(*left), measuring.right = camera_of(*right);
  measuring.arm = rig.arm;
  measuring.ePl = rig.laser.ePl;
  return measuring;
}

std::vector<BudgetTarget> budget_targets(const RigObject& object) {
  constexpr std::size_t kSamples = 500;
  std::vector<BudgetTarget> targets;
  const TriangleMesh mesh = read_mesh(object.mesh);
  for (const SurfaceSample& sample : sample_surface(mesh, kSamples)) {
    const Eigen::Vector3i& t = mesh.triangles[sample.triangle];
    const Vector3d& a = mesh.vertices[t[0]];
    const Vector3d normal = (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).normalized();
    targets.push_back({object.bMo * sample.p, object.bMo.linear() * normal});
  }
  return targets;
}

Budget budget_of(const RigConfig& rig) {
  const MeasuringRig measuring = measuring_rig(rig);
  const BudgetSweep sweep = sweep_of(rig);
  std::array<double, kJoints> tick{};
  for (int joint = 0; joint < kJoints; ++joint)
    tick[static_cast<std::size_t>(joint)] =
        rig.arm.actuators[static_cast<std::size_t>(joint)].resolution(rig.scan.posture[joint]);
  return error_budget(measuring, sweep, budget_targets(rig.object),
                      uncertainties_of(measuring, rig.calibration ? &rig.calibration->values : nullptr, sweep, tick));
}

Budget budget_of_drawings(const RigConfig& rig, const RigConfig& drawn) {
  const MeasuringRig measuring = measuring_rig(rig);
  const BudgetSweep sweep = sweep_of(rig);
  const double late =
      seconds(rig.find_camera(CameraRole::kMono)->time_offset - drawn.find_camera(CameraRole::kMono)->time_offset);
  return error_budget(measuring, sweep, budget_targets(rig.object),
                      differences_of(measuring, measuring_rig(drawn), late, sweep));
}

}  // namespace tankrig::app
