// The recording part of `tankrig scan`: the rig's devices, the scan, and the session it leaves.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

#include "apps/tankrig/arm/arm_motion.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/devices/backend.hpp"
#include "pipeline/live_reconstruction.hpp"
#include "rig/config/rig_config.hpp"
#include "rig/scan/scan.hpp"
#include "session/reading/session.hpp"
#include "sim_backends/world/tank_world.hpp"

namespace tankrig::app {

struct ScanOptions {
  std::string command = "scan";  ///< what the user runs, for messages
  std::string rig = "tank-sim";  ///< name below etc/rigs, or a path to a rig.yaml
  std::string preset;
  std::filesystem::path calibration;  ///< instead of the rig file's; empty: the rig file's, if it names one
  sim::WorldOptions world;
  std::string lux = "auto";  ///< "auto" reads the lux meter, or a value by hand
  std::string carrier;       ///< of the arm: "can" or "serial"; empty: the rig file's
  std::string operator_name, notes;
  std::filesystem::path faults;     ///< fault plan for simulated or emulated devices; empty: none
  std::filesystem::path out;        ///< session directory; empty: sessions/<rig>-<UTC>
  std::vector<std::string> waived;  ///< "commission"
  std::string coverage_mm;          ///< thresholds of the scores; empty: the rig file's
  bool json = false, dry_run = false, draw = false, yes = false;
  /// Sees every frame that is recorded, and must not wait; nobody writes to its pixels any more. Empty: nobody.
  std::function<void(const FrameRecord&, const cv::Mat&)> on_frame;
};

inline constexpr ConfigRange kLuxRange{0, kMaxLux};  ///< of --lux [lx]

/// Errors: InputError unless --lux is "auto" or a number of kLuxRange.
void check_lux(const std::string& lux);

struct Recording {
  ScanResult result;
  std::chrono::steady_clock::time_point parked;
  std::unique_ptr<LiveReconstruction> live;  ///< none if it could not begin
  /// In real time people wait for the report: its frames become pictures after it, and are here until then. Empty: they
  /// are pictures.
  std::map<std::string, cv::Mat> unwritten;
};

/// sessions/RIG-20170503T091244Z, numbered if there is one already. Nothing of a rig's name leads elsewhere.
std::filesystem::path default_session(std::string rig);

/// Moves the arm and records the session. `live`: it is reconstructed meanwhile; null: it is not. `commission`:
/// SessionInfo::commission.
/// Errors: what the disk refuses.
Recording record_session(const ScanOptions& options, const RigConfig& rig, const PipelineParameters* live,
                         const ScanPlan& plan, Backend& backend, const std::filesystem::path& path,
                         const std::string& commission, Progress& progress, Motion& motion);

}  // namespace tankrig::app
