#include "apps/tankrig/dry_run.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/output.hpp"
#include "apps/tankrig/surface_view.hpp"
#include "bench/metrics/triangle_mesh.hpp"

namespace tankrig::app {
namespace {

Obstacles obstacles_of(const RigConfig& rig) {
  Obstacles out;
  out.tank_size = rig.obstacles.tank_size;
  out.wMb = rig.obstacles.wMb;
  out.margin = rig.obstacles.margin;
  out.link_radius = rig.obstacles.link_radius;
  out.tool_length = rig.obstacles.tool_length;
  for (const RigCarriedBody& body : rig.obstacles.carried) out.carried.push_back({body.from_e, body.to_e, body.radius});
  const Eigen::AlignedBox3d box = read_mesh(rig.object.mesh).bounds();
  out.boxes.push_back({"object", rig.object.bMo * Eigen::Translation3d(box.center()), 0.5 * box.sizes()});
  return out;
}

struct Harvest {
  int frames = 0;
  double bytes = 0;  ///< upper bound: colour images before compression
};

Harvest harvest_of(const ScanPlan& plan, const RigConfig& rig) {
  Harvest out;
  for (const RigCamera& camera : rig.cameras) {
    const int frames = expected_frames(rig, camera, plan);
    out.frames += frames;
    out.bytes += 3.0 * camera.model.width * camera.model.height * frames;
  }
  return out;
}

}  // namespace

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

MotionCheck check_plan(const RigConfig& rig, const ScanPlan& plan) {
  MotionLimits limits;
  limits.angle_margin = rig.motion_limits.angle_margin;
  limits.max_velocity = rig.motion_limits.max_velocity;
  limits.max_ticks_per_s = rig.motion_limits.max_ticks_per_s;
  return check_motion(plan, rig.arm, obstacles_of(rig), limits);
}

void print_dry_run(const RigConfig& rig, const ScanPlan& plan, const MotionCheck& check, bool json) {
  const SurfaceView view = surface_view(rig, plan);
  const Harvest harvest = harvest_of(plan, rig);
  if (json) {
    nlohmann::ordered_json out;
    for (const Segment& s : plan.segments())
      out["path"].push_back({{"segment", s.name},
                             {"begin_s", s.begin},
                             {"duration_s", s.duration},
                             {"laser", s.laser},
                             {"elbow_to_rad", plan.at(s.end()).q[kElbow]}});
    out["clearance_m"] = check.min_clearance;
    out["nearest"] = check.nearest;
    out["duration_s"] = plan.duration();
    out["frames"] = harvest.frames;
    out["disk_bytes"] = harvest.bytes;
    out["faces"] = view.json();
    print_json(out);
    return;
  }
  std::printf("%-26s %8s %9s  %-5s  %s\n", "segment", "begin", "duration", "laser", "elbow at its end");
  for (const Segment& s : plan.segments())
    std::printf("%-26s %6.2f s %7.2f s  %-5s  %.3f rad\n", s.name.c_str(), s.begin, s.duration, s.laser ? "on" : "off",
                plan.at(s.end()).q[kElbow]);
  std::printf("clearance  %.0f mm, %s, during %s\n", 1e3 * check.min_clearance, check.nearest.c_str(),
              check.where.c_str());
  std::printf("duration   %.1f s\nframes     %d\ndisk need  at most %.0f MB\n", plan.duration(), harvest.frames,
              harvest.bytes / 1e6);
  std::printf("%s", view.table().c_str());
}

}  // namespace tankrig::app
