// How punctual a scan in real time was: into its session, onto the screen, into JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "rig/config/rig_config.hpp"
#include "rig/scan/scan.hpp"
#include "session/recording/session_writer.hpp"

namespace tankrig::app {

/// `timing` and `platform` of session.yaml, and timing.csv. Nothing where the clock was virtual.
void keep_timing(SessionWriter& writer, const RigConfig& rig, const ScanResult& result);

/// The table on standard output. Nothing where the clock was virtual.
void print_timing(const RigConfig& rig, const ScanResult& result);

nlohmann::ordered_json timing_json(const SessionTiming& timing);

}  // namespace tankrig::app
