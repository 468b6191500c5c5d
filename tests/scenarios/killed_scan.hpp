// What becomes of laser and arm, which have no watchdogs, when the process that commands them ends in ways it cannot see:
// its guardian acts, and the watchdog box takes their supply.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/time.hpp"

namespace tankrig::scenarios {

/// What happens to a scan in its sweep, the laser on and the arm moving.
enum class Ending {
  kKilled,          ///< SIGKILL
  kOutOfMemory,     ///< its whole control group is killed, as the out-of-memory killer does (memory.oom.group)
  kStopped,         ///< SIGSTOP; SIGCONT once laser and arm are safe
  kFrozen,          ///< its control group is frozen; thawed once laser and arm are safe
  kGuardianKilled,  ///< SIGKILL of its guardian
  kBothKilled,      ///< SIGKILL of both at once
  kLinesPulled,     ///< laser and arm are unplugged and it is killed; they are plugged in 5 s later
};
const char* to_string(Ending ending);
std::vector<Ending> endings();

struct Killed {
  Ending ending{};
  bool in_sweep = false;  ///< laser on and arm moving when it happened; else nothing was measured
  std::string skipped;    ///< why it could not be made here
  Stamp when{};           ///< the signal, at most a cycle after the last completed step; the lines' return
  std::optional<Stamp> off_byte, rest;  ///< on the relay's line and on the arm's wire
  std::optional<Stamp> last_edge, cut;  ///< of the watchdog box: its newest edge; when both contactors opened
  bool woke_up = false;                 ///< one that was stopped: lit or moved again afterwards
  bool ended = true;                    ///< the scan ended by itself, where it was not killed
  Duration machine_late{};              ///< MachineWitness, all the while
};

/// Scans over `carrier` in a process of its own, with its guardian.
Killed end_scan(const std::string& carrier, Ending ending);

/// From `when`, at most, each; nothing: nobody acts but the box, whose contactors open at most kBoxOpens after its last
/// edge in every ending.
struct EndingBounds {
  std::optional<Duration> off_byte, rest;
};
EndingBounds bounds(Ending ending);

/// As verdict.hpp's.
bool too_late(const Killed& killed);
std::string broken(const Killed& killed);

/// The guardian of such a scan: `reliability guardian ...`.
int run_scan_guardian(char** argv);

}  // namespace tankrig::scenarios
