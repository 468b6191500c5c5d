#include "apps/tankrig/bench/scan_trace.hpp"

#include <algorithm>
#include <limits>

#include "apps/tankrig/scan/plan_check.hpp"
#include "bench/metrics/triangle_mesh.hpp"

namespace tankrig::app {
namespace {

constexpr double kTraceStep = 0.02;  ///< between the samples that measures look at [s]

/// Clearance of the arm from object, floor and walls.
class NearestSolid {
 public:
  explicit NearestSolid(const RigConfig& rig) : clearance_(rig.arm, obstacles_of(rig)) {
    for (std::size_t pair = 0; pair < clearance_.pairs(); ++pair)
      if (clearance_.kind(pair) == PairKind::kObject || clearance_.kind(pair) == PairKind::kTank)
        pairs_.push_back(pair);
  }
  double at(const JointVector& q) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (const std::size_t pair : pairs_) nearest = std::min(nearest, clearance_.at(pair, q));
    return nearest;
  }

 private:
  Clearance clearance_;
  std::vector<std::size_t> pairs_;
};

}  // namespace

RunTrace trace_of_rig(const RigConfig& rig, const std::vector<CalibratedCamera>& cameras, std::optional<double> lux) {
  RunTrace trace;
  const Transform wMb = rig.obstacles.wMb;
  const auto fixed = [](const Transform& pose) { return [pose](const JointVector&) { return pose; }; };
  trace.bodies["tank"] = fixed(Transform::Identity());
  trace.bodies["base"] = fixed(wMb);
  trace.bodies["object"] = fixed(wMb * rig.object.bMo);
  trace.bodies["end_effector"] = [wMb, arm = rig.arm](const JointVector& q) -> Transform { return wMb * arm.bMe(q); };
  for (const CalibratedCamera& camera : cameras) {
    trace.bodies[camera.name] = fixed(wMb * camera.bMc);
    trace.cameras[camera.name] = {camera.model, wMb * camera.bMc};
  }
  trace.corners["object"] = read_mesh(rig.object.mesh).vertices;
  trace.numbers["joints"] = [](const TraceSample& sample) {
    return std::vector<double>(sample.q.data(), sample.q.data() + sample.q.size());
  };
  trace.numbers["end_effector"] = [body = trace.bodies["end_effector"]](const TraceSample& sample) {
    const Vector3d p = body(sample.q).translation();
    return std::vector<double>{p.x(), p.y(), p.z()};
  };
  trace.lux = lux;
  return trace;
}

RunTrace trace_of_scan(const RigConfig& rig, const ScanPlan& plan, Stamp plan_begin,
                       const std::vector<JointState>& joints, const Session& session, std::optional<double> lux) {
  RunTrace trace = trace_of_rig(rig, session.info.cameras, lux);
  const NearestSolid solids(rig);
  const Stamp begin = joints.front().stamp;
  for (const JointState& state : joints) {
    const double t = seconds(state.stamp - begin);
    if (!trace.samples.empty() && t < trace.samples.back().t_s + kTraceStep) continue;
    const double in_plan = seconds(state.stamp - plan_begin);
    const MotionPoint planned = plan.at(in_plan);
    const std::size_t segment = plan.segment_at(in_plan);
    trace.samples.push_back({t, state.q, state.velocity, planned.q, planned.velocity, static_cast<int>(segment),
                             plan.segments()[segment].phase, state.current_a, solids.at(state.q)});
  }
  for (const FrameRecord& frame : session.frames)
    trace.frames.push_back({seconds(frame.stamp - begin), seconds(frame.sync_residual), frame.sync_on_target});
  for (const auto& [camera, account] : session.info.account) {
    for (const auto& [reason, count] : frame_reasons(session.info.counts, camera))
      if (reason != "not_recorded") trace.frames_lost += count;
    trace.frames_lost += static_cast<std::uint64_t>(std::max<std::int64_t>(0, account.unaccounted));
  }
  return trace;
}

}  // namespace tankrig::app
