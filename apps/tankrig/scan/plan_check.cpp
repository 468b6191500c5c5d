#include "apps/tankrig/scan/plan_check.hpp"

#include <utility>

#include "apps/tankrig/devices/camera_info.hpp"
#include "bench/metrics/triangle_mesh.hpp"
#include "core/input_error.hpp"
#include "rig/plan/light_check.hpp"
#include "rig/platform/machine.hpp"
#include "session/recording/spool_pictures.hpp"

namespace tankrig::app {
namespace {

/// Tables, logs, clouds, pictures, report, and the recorder's reserve.
constexpr std::uint64_t kBesideFrames = 64 << 20;

}  // namespace

Obstacles obstacles_of(const RigConfig& rig) {
  Obstacles obstacles = rig.obstacles;
  for (const RigCamera& camera : rig.cameras) obstacles.cameras.push_back({camera.name, camera.housing()});
  TriangleMesh mesh = read_mesh(rig.object.mesh);
  for (Vector3d& vertex : mesh.vertices) vertex = rig.object.bMo * vertex;
  obstacles.object = {std::move(mesh.vertices), std::move(mesh.triangles)};
  return obstacles;
}

MotionCheck check_plan(const RigConfig& rig, const ScanPlan& plan) {
  return check_motion(plan, rig.arm, obstacles_of(rig), rig.motion_limits);
}

int expected_frames(const RigConfig& rig, const RigCamera& camera, const ScanPlan& plan) {
  const double period = 1 / camera.rate_hz;
  const double in_sweep =
      camera.trigger.mode == TriggerMode::kPosition ? camera.trigger.spacing / rig.scan.sweep.velocity : period;
  int frames = 0;
  if (camera.record != RecordWhen::kSweep)
    frames += plan.expected_frames(RecordWhen::kDark, period, rig.scan.capture.dark_frames);
  if (camera.record != RecordWhen::kDark && camera.trigger.mode == TriggerMode::kPosition)
    frames += rig.scan.sweep.passes;  // a pass has an angle more than spacings
  if (camera.record != RecordWhen::kDark)
    frames += plan.expected_frames(RecordWhen::kSweep, in_sweep, rig.scan.capture.dark_frames);
  return frames;
}

std::uint64_t disk_need(const RigConfig& rig, const ScanPlan& plan) {
  std::uint64_t raw = 0;
  for (const RigCamera& camera : rig.cameras) {
    const CameraInfo info = camera_info(rig, camera);
    raw += static_cast<std::uint64_t>(expected_frames(rig, camera, plan)) * static_cast<std::uint64_t>(info.channels) *
           static_cast<std::uint64_t>(info.width) * static_cast<std::uint64_t>(info.height);
  }
  return most_on_disk(raw) + kBesideFrames;
}

void check_room(const RigConfig& rig, const ScanPlan& plan, const std::filesystem::path& path) {
  const Finding room = room_finding(path, free_space(path), disk_need(rig, plan));
  if (room.refused) throw InputError(room.measured + "; nothing was moved; " + room.cure);
}

ScanPlan sweep_plan(const RigConfig& rig, const JointVector& posture) {
  ScanPlan plan = make_scan_plan(rig.scan, posture);
  check_light(plan, rig.scan.safety);
  for (const RigCamera& camera : rig.cameras)
    check_witness(plan, rig.scan.safety.beam, {camera.name, camera.model.width, camera.model.height}, camera.record);
  return plan;
}

}  // namespace tankrig::app
