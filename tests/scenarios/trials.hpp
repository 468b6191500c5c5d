// Every fault of every device as it is put to the test, and what must come of it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim_backends/faults/fault_plan.hpp"

namespace tankrig::scenarios {

/// The mock rig in virtual time, or the emulated wires with the arm on one of its carriers.
enum class Place : std::uint8_t { kMock, kCan, kSerial };
const char* to_string(Place place);

struct Trial {
  Place place{};
  sim::FaultSpec fault;
  std::string must;     ///< words of the scan's status, or others after " or "; "complete": nothing stops it
  std::string lux;      ///< words of the lux meter's reading after the scan
  std::string counted;  ///< a count of the session that must not be 0
};

/// From the fault's begin to its detection, at most, on a machine that is never late: the time-out of whoever must
/// notice it, and what the fault itself takes to show. Nothing: nobody has to.
std::optional<Duration> longest_detection(const Trial& trial);

/// What differs from a plan's defaults: "ratio 0.1, delay 400 ms".
std::string argument(const sim::FaultSpec& fault);

/// The scenarios that have one fault: on the mocks, and on the wires that their rows name.
std::vector<Trial> trials();

/// A kind that has no trial on a device.
struct Absence {
  sim::FaultDevice device{};
  sim::FaultKind kind{};
  std::string where, reason;  ///< an empty reason: it should have been tried
};
std::vector<Absence> absences();

}  // namespace tankrig::scenarios
