#include "apps/tankrig/plan_check.hpp"

#include "bench/metrics/triangle_mesh.hpp"

namespace tankrig::app {

MotionCheck check_plan(const RigConfig& rig, const ScanPlan& plan) {
  Obstacles obstacles = rig.obstacles;
  const Eigen::AlignedBox3d box = read_mesh(rig.object.mesh).bounds();
  obstacles.boxes.push_back({"object", rig.object.bMo * Eigen::Translation3d(box.center()), 0.5 * box.sizes()});
  return check_motion(plan, rig.arm, obstacles, rig.motion_limits);
}

int expected_frames(const RigConfig& rig, const RigCamera& camera, const ScanPlan& plan) {
  const double period = 1 / camera.rate_hz;
  const double in_sweep =
      camera.trigger.mode == TriggerMode::kPosition ? camera.trigger.spacing / rig.scan.sweep_velocity : period;
  int frames = 0;
  if (camera.record != RecordWhen::kSweep)
    frames += plan.expected_frames(RecordWhen::kDark, period, rig.scan.dark_frames);
  if (camera.record != RecordWhen::kDark && camera.trigger.mode == TriggerMode::kPosition)
    frames += rig.scan.passes;  // a pass has an angle more than spacings
  if (camera.record != RecordWhen::kDark)
    frames += plan.expected_frames(RecordWhen::kSweep, in_sweep, rig.scan.dark_frames);
  return frames;
}

}  // namespace tankrig::app
