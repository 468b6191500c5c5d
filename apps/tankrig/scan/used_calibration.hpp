// The calibration that a rig file names, as a scan uses it: what to warn of, and the session's copy.
#pragma once

#include <ctime>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/tankrig/command_line/command_line.hpp"
#include "rig/config/rig_config.hpp"
#include "session/recording/session_writer.hpp"

namespace tankrig::app {

inline void add_calibration_option(CLI::App* command, std::filesystem::path& calibration) {
  command->add_option("--calibration", calibration, "Calibration file to use instead of the one the rig file names")
      ->check(CLI::ExistingFile);
}

/// SHA-256 of what a calibration is of: Calibration::rig_sha256.
std::string calibration_basis_sha256(const RigConfig& nominal);

/// Why the rig's calibration may be wrong at `now`: rejected, not judged, of another rig, old. Empty without one.
std::vector<std::string> calibration_warnings(const RigConfig& rig, std::time_t now = std::time(nullptr));

/// Puts calibration.yaml into the session, where there is one.
void keep_calibration(const RigConfig& rig, SessionWriter& writer);

}  // namespace tankrig::app
