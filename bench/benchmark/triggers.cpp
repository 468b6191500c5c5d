// When measures start and stop.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/benchmark/run_trace.hpp"

namespace tankrig {
namespace {

std::string known(const auto& names) {
  std::string list;
  for (const auto& name : names) list += (list.empty() ? "" : ", ") + std::string(name);
  return list.empty() ? "none" : list;
}

std::string known_keys(const auto& map) {
  std::vector<std::string> names;
  for (const auto& entry : map) names.push_back(entry.first);
  return known(names);
}

/// The first sample for which it holds, then all.
template <class Holds>
std::vector<bool> latched(const RunTrace& trace, Holds holds) {
  std::vector<bool> out(trace.samples.size());
  bool now = false;
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = now = now || holds(i);
  return out;
}

std::size_t joint_of(const std::string& name) {
  return static_cast<std::size_t>(std::find(kJointNames.begin(), kJointNames.end(), name) - kJointNames.begin());
}

}  // namespace

std::string trigger_refusal(const Trigger& trigger, const RunTrace& trace, const BenchmarkNames& names) {
  const std::string& target = names.of(trigger.target);
  const auto among = [&](const auto& list, const char* what) -> std::string {
    for (const auto& name : list)
      if (target == name) return {};
    return fmt::format("this rig has no {} '{}', expected one of: {}", what, trigger.target, known(list));
  };
  switch (trigger.kind) {
    case TriggerKind::kOnInit:
    case TriggerKind::kNever:
      return {};
    case TriggerKind::kService:
      return among(kRunServices, "command");
    case TriggerKind::kTopic:
      return among(kRunTopics, "state");
    case TriggerKind::kScanPhase:
      return among(kNames<Phase>, "phase");
    case TriggerKind::kJointAngle:
      return among(kJointNames, "joint");
    case TriggerKind::kLuxLevel:
      return trace.lux ? "" : "this rig has no lux meter";
    case TriggerKind::kOnMove:
    case TriggerKind::kOnNoMove:
    case TriggerKind::kPosition:
      if (trace.bodies.contains(target)) return {};
      return fmt::format("this rig has no body '{}' (no free vehicle), expected one of: {}", trigger.target,
                         known_keys(trace.bodies));
  }
  return {};
}

std::vector<bool> triggered(const Trigger& trigger, const RunTrace& trace, const BenchmarkNames& names,
                            Arithmetic arithmetic) {
  const std::string& target = names.of(trigger.target);
  const std::vector<TraceSample>& samples = trace.samples;
  const auto reach = [&](double metres) { return arithmetic == Arithmetic::kUwsim ? std::sqrt(metres) : metres; };
  const auto place = [&](std::size_t i) -> Vector3d { return trace.bodies.at(target)(samples[i].q).translation(); };
  const auto sweeping = [&](std::size_t i) { return samples[i].phase == Phase::kSweep; };
  switch (trigger.kind) {
    case TriggerKind::kOnInit:
      return std::vector<bool>(samples.size(), true);
    case TriggerKind::kNever:
      return std::vector<bool>(samples.size(), false);
    case TriggerKind::kService:
      if (target == "scan_start") return std::vector<bool>(samples.size(), true);
      if (target == "sweep_start") return latched(trace, sweeping);
      return latched(trace, [&](std::size_t i) { return i > 0 && sweeping(i - 1) && !sweeping(i); });
    case TriggerKind::kTopic: {
      std::vector<bool> out(samples.size());
      for (std::size_t i = 0; i < out.size(); ++i)
        out[i] = target == "sweeping" ? sweeping(i) : samples[i].planned_velocity.isZero(1e-9);
      return out;
    }
    case TriggerKind::kScanPhase:
      return latched(trace, [&](std::size_t i) { return target == to_string(samples[i].phase); });
    case TriggerKind::kJointAngle: {
      const auto joint = static_cast<Eigen::Index>(joint_of(target));
      return latched(trace, [&](std::size_t i) {
        return i > 0 && (samples[i - 1].q[joint] - trigger.value) * (samples[i].q[joint] - trigger.value) <= 0;
      });
    }
    case TriggerKind::kLuxLevel:
      return std::vector<bool>(samples.size(), *trace.lux >= trigger.value);
    case TriggerKind::kPosition:
      return latched(trace,
                     [&](std::size_t i) { return (place(i) - trigger.position).norm() < reach(kPositionDistance); });
    case TriggerKind::kOnMove:
      return latched(trace, [&](std::size_t i) { return (place(i) - place(0)).norm() > reach(kMoveDistance); });
    case TriggerKind::kOnNoMove: {
      std::size_t since = 0;
      return latched(trace, [&](std::size_t i) {
        if ((place(i) - place(since)).norm() >= reach(kMoveDistance)) since = i;
        return samples[i].t_s - samples[since].t_s >= kNoMoveTime;
      });
    }
  }
  return {};
}

std::vector<bool> counting(const Benchmark& benchmark, const Measure& measure, const RunTrace& trace,
                           const BenchmarkNames& names) {
  const auto of = [&](const Trigger& trigger) { return triggered(trigger, trace, names, measure.arithmetic); };
  const std::vector<bool> starts[] = {of(benchmark.start), of(measure.start)};
  const std::vector<bool> stops[] = {of(benchmark.stop), of(measure.stop)};
  std::vector<bool> out(trace.samples.size());
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = starts[0][i] && starts[1][i] && !stops[0][i] && !stops[1][i];
  return out;
}

std::string measure_refusal(const Measure& measure, const RunTrace& trace, const BenchmarkNames& names) {
  const auto body = [&](const std::string& name) -> std::string {
    if (trace.bodies.contains(names.of(name))) return {};
    return fmt::format("this rig has no body '{}' (no free vehicle), expected one of: {}", name,
                       known_keys(trace.bodies));
  };
  const auto camera = [&](const std::string& name) -> std::string {
    if (trace.cameras.contains(names.of(name))) return {};
    return fmt::format("this rig has no camera '{}', expected one of: {}", name, known_keys(trace.cameras));
  };
  const auto first_of = [](std::initializer_list<std::string> refusals) {
    for (const std::string& refusal : refusals)
      if (!refusal.empty()) return refusal;
    return std::string();
  };
  std::string refusal =
      first_of({trigger_refusal(measure.start, trace, names), trigger_refusal(measure.stop, trace, names)});
  if (!refusal.empty()) return refusal;
  switch (measure.kind) {
    case MeasureKind::kCollision:
      if (refusal = body(measure.target); !refusal.empty() || names.of(measure.target) == "end_effector")
        return refusal;
      return fmt::format("'{}' does not move on this rig, expected end_effector", measure.target);
    case MeasureKind::kPositionError:
      return first_of({body(measure.target), measure.topic.empty() ? "" : body(measure.topic)});
    case MeasureKind::kDistance:
      return body(measure.target);
    case MeasureKind::kEuclideanNorm: {
      if (!trace.numbers.contains(names.of(measure.target)))
        return fmt::format("this rig has no stream of numbers '{}', expected one of: {}", measure.target,
                           known_keys(trace.numbers));
      const GroundTruth& truth = measure.truth;
      if (truth.kind == GroundTruthKind::kConstant) return {};
      if (truth.kind == GroundTruthKind::kRelativeLocation) return first_of({body(truth.from), body(truth.to)});
      if (const std::string no = first_of({camera(truth.camera), body(truth.target)}); !no.empty()) return no;
      return trace.corners.contains(names.of(truth.target)) ? "" : fmt::format("'{}' has no mesh", truth.target);
    }
    case MeasureKind::kObjectCenteredOnCam:
      return first_of({body(measure.target), camera(measure.camera)});
    case MeasureKind::kReconstruction3D:
      return first_of({body(measure.target), body(measure.from)});
    case MeasureKind::kPathFollowing:
      if (!measure.topic.empty() && names.of(measure.topic) != "plan")
        return fmt::format("this rig has no path '{}', expected plan", measure.topic);
      return body(measure.target);
    default:
      return {};
  }
}

}  // namespace tankrig
