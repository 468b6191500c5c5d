// The table of scenarios, a file a device: what goes wrong, and what must happen then. Keys: docs/reference/faults.md.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/scenarios/small_rig.hpp"

namespace tankrig::scenarios {

struct Expected {
  std::string status;              ///< "complete", or words of the reason
  std::vector<std::string> tells;  ///< words of messages that must be shown
  std::vector<std::string> not_told;
  std::string left = "laser off, arm at rest";
  std::uint64_t laser_off_cycles = 2;           ///< from detection, at most
  std::uint64_t arm_stop_cycles = 1;            ///< from there, at most
  std::uint64_t fault_to_laser_off_cycles = 0;  ///< from the fault's begin, at most; 0: the scan is not stopped
  std::uint64_t fault_to_arm_stop_cycles = 0;
  bool beam_left_on = false;  ///< the light itself
  std::string lux;            ///< words of the reading after the scan
  std::map<std::string, std::pair<std::uint64_t, std::uint64_t>> counts;
  int frames = 0;  ///< at least, in the session that is left
};

struct Scenario {
  std::string name;
  sim::FaultPlan plan;
  Expected expected;
  int disk_kib = 0;                          ///< the session lies on a file system of this size; 0: the test's own
  cv::Size picture{320, 240};                ///< of the cameras [px]
  int file_kib = 0;                          ///< no file may become larger than this; 0: no limit
  std::map<std::string, std::string> wires;  ///< by carrier: words of the status on emulated wires
  std::string wires_counted;                 ///< there a count of the session that must not be 0
};

/// tests/scenarios/DEVICE.yaml of every device, in the order of the tables.
/// Errors: InputError with file and line.
std::vector<Scenario> scenarios();
/// Its name, for messages of a test.
std::ostream& operator<<(std::ostream& out, const Scenario& scenario);

/// What is not as expected, a line each. `session`: the one that was left.
std::vector<std::string> differences(const Scenario& scenario, const Outcome& outcome,
                                     const std::filesystem::path& session);

/// "detected after 253 ms, laser off 0 cycles later, arm stopped 0 cycles later, ..."
std::string summary(const Outcome& outcome);

}  // namespace tankrig::scenarios
