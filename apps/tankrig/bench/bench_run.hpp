// A benchmark on the simulated rig: its configurations, one by one, from one scan for each that the arm or the water
// tells apart. Or on a recorded session, whose pictures a bagFogUpdater puts into fog.
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/tankrig/bench/evaluation.hpp"
#include "apps/tankrig/bench/layered_scan.hpp"
#include "apps/tankrig/bench/session_scan.hpp"

namespace tankrig::app {

/// Threads: evaluate() from any number.
class BenchRun {
 public:
  /// Resolves what the file names; `refusals` says, element by element, what this rig cannot mean: it is left out.
  /// Errors: InputError.
  BenchRun(Benchmark benchmark, RigConfig rig, const sim::WorldOptions& world, Progress& progress);

  const Benchmark& benchmark() const { return evaluation_.benchmark(); }  ///< without what was left out of its loops
  const std::vector<std::string>& refusals() const { return evaluation_.refusals(); }
  /// What was run: hashes, versions, options.
  const nlohmann::ordered_json& identity() const { return evaluation_.identity(); }

  Condition condition(std::size_t point) const { return evaluation_.condition(point); }
  /// The scan of a condition, made when it is first asked for. Only the newest stays.
  std::shared_ptr<const MeasuredScan> scan(const Condition& condition);
  std::vector<std::string> programs() const { return evaluation_.programs(); }
  Evaluated evaluate(std::size_t point, const MeasuredScan& scan) const { return evaluation_.evaluate(point, scan); }
  /// Camera views over light and noise, and each measured cloud in the brightest, quietest configuration, as PNG in
  /// FOLDER/figures. Returns their names.
  std::vector<std::string> write_pictures(const std::filesystem::path& folder);

 private:
  RigConfig changed_rig(const Condition& condition) const;
  /// The session that a bagFogUpdater names, if there is one.
  /// Errors: InputError where another rig recorded it.
  void open_recording();
  void refuse_updaters();
  void refuse_updaters_of(const MeasuredScan& scan);
  std::shared_ptr<const LayeredScan> layered(const Condition& condition);

  RigConfig rig_;
  Progress& progress_;
  Evaluation evaluation_;
  std::shared_ptr<const SessionScan> recording_;
  int recording_line_ = 0;  ///< of its bagFogUpdater

  std::mutex mutex_;  // guards what follows
  std::string key_;
  std::shared_ptr<const LayeredScan> scan_;
};

}  // namespace tankrig::app
