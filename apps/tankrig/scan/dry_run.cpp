#include "apps/tankrig/scan/dry_run.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/scan/plan_check.hpp"
#include "apps/tankrig/scan/plan_drawing.hpp"
#include "apps/tankrig/scan/surface_view.hpp"

namespace tankrig::app {
namespace {

int frames_planned(const ScanPlan& plan, const RigConfig& rig) {
  int frames = 0;
  for (const RigCamera& camera : rig.cameras) frames += expected_frames(rig, camera, plan);
  return frames;
}

nlohmann::ordered_json clearances_json(const MotionCheck& check) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (std::size_t kind = 0; kind < check.nearest_of.size(); ++kind) {
    const Approach& a = check.nearest_of[kind];
    if (a.pair.empty()) continue;
    out.push_back({{"kind", kPairKindNames[kind]},
                   {"clearance_m", a.clearance},
                   {"pair", a.pair},
                   {"segment", a.segment},
                   {"time_s", a.when},
                   {"posture_rad", std::vector<double>(a.q.begin(), a.q.end())}});
  }
  return out;
}

void print_clearances(const MotionCheck& check) {
  for (std::size_t kind = 0; kind < check.nearest_of.size(); ++kind) {
    const Approach& a = check.nearest_of[kind];
    if (!a.pair.empty())
      std::printf("  %-16s %5.0f mm  %s, during %s at %.1f s, %s\n", kPairKindNames[kind], 1e3 * a.clearance,
                  a.pair.c_str(), a.segment.c_str(), a.when, posture_text(a.q).c_str());
  }
}

}  // namespace

void print_dry_run(const RigConfig& rig, const ScanPlan& plan, const MotionCheck& check, bool json, bool draw) {
  const SurfaceView view = surface_view(rig, plan);
  const int frames = frames_planned(plan, rig);
  const std::uint64_t need = disk_need(rig, plan);
  if (json) {
    nlohmann::ordered_json out;
    for (const Segment& s : plan.segments())
      out["path"].push_back({{"segment", s.name},
                             {"begin_s", s.begin},
                             {"duration_s", s.duration},
                             {"laser", s.laser},
                             {"elbow_to_rad", plan.at(s.end()).q[kElbow]}});
    out["clearance_m"] = check.nearest().clearance;
    out["nearest"] = check.nearest().pair;
    out["clearances"] = clearances_json(check);
    out["duration_s"] = plan.duration();
    out["frames"] = frames;
    out["disk_bytes"] = need;
    out["faces"] = view.json();
    if (draw) out["drawing"] = plan_drawing(rig, plan, check);
    print_json(out);
    return;
  }
  std::printf("%-26s %8s %9s  %-5s  %s\n", "segment", "begin", "duration", "laser", "elbow at its end");
  for (const Segment& s : plan.segments())
    std::printf("%-26s %6.2f s %7.2f s  %-5s  %.3f rad\n", s.name.c_str(), s.begin, s.duration, s.laser ? "on" : "off",
                plan.at(s.end()).q[kElbow]);
  std::printf("clearance  %.0f mm, %s; of each kind of pair:\n", 1e3 * check.nearest().clearance,
              check.nearest().pair.c_str());
  print_clearances(check);
  std::printf("duration   %.1f s\nframes     %d\ndisk need  at most %.0f MB\n", plan.duration(), frames,
              static_cast<double>(need) / 1e6);
  std::printf("%s", view.table().c_str());
}

}  // namespace tankrig::app
