// A benchmark on the simulated rig: its configurations, one by one, from one scan for each that the arm or the water
// tells apart.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/tankrig/bench/calibration_error.hpp"
#include "apps/tankrig/bench/layered_scan.hpp"
#include "bench/benchmark/benchmark.hpp"
#include "pipeline/score_session.hpp"

namespace tankrig::app {

/// One configuration, as the rig takes it.
struct Condition {
  sim::WorldOptions world;               ///< of the scan
  std::optional<double> sweep_velocity;  ///< [rad/s]
  std::optional<JointVector> posture;    ///< of the joints that do not sweep [rad]
  std::string cloud;                     ///< that an algorithmUpdater has chosen
  std::vector<CalibrationError> errors;
  PictureConditions pictures;

  /// Conditions with the same key share a scan.
  std::string scan_key() const;
};

/// Threads: evaluate() from any number.
class BenchRun {
 public:
  /// Resolves what the file names; `refusals` says, element by element, what this rig cannot mean: it is left out.
  /// Errors: InputError.
  BenchRun(Benchmark benchmark, RigConfig rig, const sim::WorldOptions& world, Progress& progress);

  const Benchmark& benchmark() const { return benchmark_; }  ///< without what was left out of its loops
  const std::vector<std::string>& refusals() const { return refusals_; }
  /// What was run: hashes, versions, options.
  const nlohmann::ordered_json& identity() const { return identity_; }

  Condition condition(std::size_t point) const;
  /// The scan of a condition, made when it is first asked for. Only the newest stays.
  std::shared_ptr<const LayeredScan> scan(const Condition& condition);
  /// The programs that it runs, each with what the file calls it.
  std::vector<std::string> programs() const;
  /// The row of one configuration, as PointStore takes it. What fails is its "error". Null: a stop came in the middle.
  nlohmann::ordered_json evaluate(std::size_t point, const LayeredScan& scan) const;
  /// Camera views over light and noise, and each measured cloud in the brightest, quietest configuration, as PNG in
  /// FOLDER/figures. Returns their names.
  std::vector<std::string> write_pictures(const std::filesystem::path& folder);

 private:
  RigConfig changed_rig(const Condition& condition) const;
  void refuse_updaters();
  void refuse_updaters_of(const LayeredScan& scan);
  void refuse(const Updater& updater, const std::string& why);
  /// Those for which `why` says something.
  void leave_out_loops(const std::function<std::string(const Updater&)>& why);
  void refuse_measures(const RunTrace& trace);
  void find_programs();
  const Algorithm* algorithm(const std::string& cloud) const;  ///< null: the cloud is ours
  bool uses_laser(const std::string& cloud) const;
  bool has_cloud(const std::string& cloud) const;
  std::string known_clouds() const;
  /// What the measure's topic means in a configuration.
  std::string cloud_of(const Measure& measure, const Condition& condition) const;
  Reconstruction reconstruct(const LayeredScan& scan, const Session& session, const std::string& cloud) const;
  void measure_cloud(const Measure& measure, const LayeredScan& scan, const RunTrace& trace, const Score& score,
                     nlohmann::ordered_json& row) const;

  Benchmark benchmark_;
  RigConfig rig_;
  sim::WorldOptions world_;
  Progress& progress_;
  BenchmarkNames names_;
  PipelineParameters parameters_;
  ObjectSurface object_;
  std::vector<std::string> refusals_;
  std::vector<bool> measured_;  ///< by measure
  nlohmann::ordered_json identity_;

  std::mutex mutex_;  // guards what follows
  std::string key_;
  std::shared_ptr<const LayeredScan> scan_;
  mutable std::mutex ceilings_mutex_;
  mutable std::map<std::pair<const LayeredScan*, std::string>, Ceiling> ceilings_;
};

}  // namespace tankrig::app
