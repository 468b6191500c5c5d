// What happened in one run of the rig, as a benchmark's triggers and measures look at it.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bench/benchmark/benchmark.hpp"
#include "core/arm_model.hpp"
#include "core/camera_model.hpp"
#include "core/frame_record.hpp"

namespace tankrig {

struct TraceSample {
  double t_s = 0;  ///< since the run began
  JointVector q = JointVector::Zero(), velocity = JointVector::Zero();
  JointVector planned_q = JointVector::Zero(), planned_velocity = JointVector::Zero();
  int segment = 0;  ///< of the plan
  Phase phase = Phase::kMove;
  double current_a = 0;    ///< of the arm's supply
  double clearance_m = 1;  ///< arm against object, floor and walls; 0 or less: they touch
};

struct TraceFrame {
  double t_s = 0;
  double sync_residual_s = 0, on_target_m = 0;
};

/// A camera that objects are projected into.
struct TraceCamera {
  CameraModel model;
  Transform wMc = Transform::Identity();
};

/// Frames: w, the tank; a body is where its frame is.
struct RunTrace {
  std::vector<TraceSample> samples;  ///< ascending in time
  std::vector<TraceFrame> frames;    ///< recorded ones
  std::uint64_t frames_lost = 0;
  std::map<std::string, std::function<Transform(const JointVector&)>> bodies;
  std::map<std::string, TraceCamera> cameras;
  std::map<std::string, std::function<std::vector<double>(const TraceSample&)>> numbers;  ///< streams
  std::map<std::string, std::vector<Vector3d>> corners;  ///< of bodies that have a shape, in their frame [m]
  std::optional<double> lux;
};

/// What benchmark files call things, and what this rig calls them. A name that is not there means itself.
struct BenchmarkNames {
  std::map<std::string, std::string> ours;

  const std::string& of(const std::string& name) const {
    const auto found = ours.find(name);
    return found == ours.end() ? name : found->second;
  }
};

/// Moments of a run that <type>service</type> can name, and states that <type>topic</type> can.
inline constexpr std::array kRunServices{"scan_start", "sweep_start", "sweep_end"};
inline constexpr std::array kRunTopics{"sweeping", "resting"};

// Distances of triggers [m], the reference module's. It compares them with a squared distance: then they are as far as
// their roots.
inline constexpr double kPositionDistance = 0.3, kMoveDistance = 0.2;
inline constexpr double kNoMoveTime = 4;  ///< [s]

/// Why this rig cannot mean the trigger; empty: it can.
std::string trigger_refusal(const Trigger& trigger, const RunTrace& trace, const BenchmarkNames& names);

/// For every sample, whether the trigger has started (or stopped) by then.
std::vector<bool> triggered(const Trigger& trigger, const RunTrace& trace, const BenchmarkNames& names,
                            Arithmetic arithmetic);

/// For every sample, whether the measure counts: benchmark and measure started, neither stopped.
std::vector<bool> counting(const Benchmark& benchmark, const Measure& measure, const RunTrace& trace,
                           const BenchmarkNames& names);

/// Why this rig cannot mean the measure; empty: it can. A reconstruction3D's cloud is judged by who makes clouds.
std::string measure_refusal(const Measure& measure, const RunTrace& trace, const BenchmarkNames& names);

/// The details of a measure, in the order of details_of(), over the first `samples` samples. What is not defined has no
/// value. Not for reconstruction3D.
std::vector<std::optional<double>> trace_values(const Measure& measure, const RunTrace& trace,
                                                const BenchmarkNames& names, const std::vector<bool>& counts,
                                                std::size_t samples);

}  // namespace tankrig
