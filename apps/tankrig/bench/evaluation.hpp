// A benchmark's measures on a rig: what they mean there, and their values for a scan, whether it was simulated in layers
// or recorded in a tank.
#pragma once

#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/tankrig/bench/bench_names.hpp"
#include "apps/tankrig/bench/condition.hpp"
#include "apps/tankrig/bench/measured_scan.hpp"
#include "bench/benchmark/benchmark.hpp"
#include "bench/sweep/point_views.hpp"
#include "pipeline/score_session.hpp"
#include "rig/config/rig_config.hpp"

namespace tankrig::app {

struct Evaluated {
  nlohmann::ordered_json row;    ///< as PointStore takes it; null: a stop came in the middle
  std::vector<PointView> views;  ///< of a configuration that is_viewed(): frames, then each measured cloud
};

/// Threads: const members from any number of threads.
class Evaluation {
 public:
  /// Resolves the programs that the file names.
  /// Errors: InputError.
  Evaluation(Benchmark benchmark, const RigConfig& rig, const sim::WorldOptions& world);

  const Benchmark& benchmark() const { return benchmark_; }  ///< without what was left out of its loops
  /// Element by element, what this rig cannot mean.
  const std::vector<std::string>& refusals() const { return refusals_; }
  /// What is run: hashes, versions, options. The caller adds what only a scan tells.
  nlohmann::ordered_json& identity() { return identity_; }
  const nlohmann::ordered_json& identity() const { return identity_; }
  /// The programs that it runs, each with what the file calls it.
  std::vector<std::string> programs() const;

  Condition condition(std::size_t point) const { return condition_at(benchmark_, point, names_, world_); }

  /// Adds a refusal.
  void refuse(const Updater& updater, const std::string& why);
  /// Leaves out those for which `why` says something, and refuses them with it.
  void leave_out_loops(const std::function<std::string(const Updater&)>& why);
  /// Why the rig cannot mean the updater's names; empty: it can.
  std::string unknown_name(const Updater& updater) const;
  /// Leaves out what nothing in such a scan can mean.
  void refuse_measures(const RunTrace& trace);
  const BenchmarkNames& names() const { return names_; }

  /// What fails is the row's "error".
  Evaluated evaluate(std::size_t point, const MeasuredScan& scan) const;

  /// The cloud of the benchmark's measure `index`; empty if it has none, or is left out.
  std::string measured_cloud(std::size_t index, const Condition& condition) const;
  bool uses_laser(const std::string& cloud) const;
  /// `believed`: `session` with what its calibration has wrong.
  Score score(const MeasuredScan& scan, const Session& session, const Session& believed,
              const std::string& cloud) const;
  const TriangleMesh& object() const { return object_.mesh(); }

 private:
  void find_programs();
  const Algorithm* algorithm(const std::string& cloud) const;  ///< null: the cloud is ours
  bool has_cloud(const std::string& cloud) const;
  std::string known_clouds() const;
  /// What the measure's topic means in a configuration.
  std::string cloud_of(const Measure& measure, const Condition& condition) const;
  std::vector<PointView> views(const Session& session, const Condition& at,
                               const std::map<std::string, Score>& scores) const;
  void measure_cloud(const Measure& measure, const MeasuredScan& scan, const RunTrace& trace, const Score& score,
                     nlohmann::ordered_json& row) const;

  Benchmark benchmark_;
  sim::WorldOptions world_;
  BenchmarkNames names_;
  PipelineParameters parameters_;
  ObjectSurface object_;
  std::vector<std::string> refusals_;
  std::vector<bool> measured_;  ///< by measure
  nlohmann::ordered_json identity_;
};

}  // namespace tankrig::app
