// The guardian: a process of its own that switches the laser off and brings the arm to rest when the program that
// commands them stops making safety steps.
#pragma once

#include <filesystem>
#include <string>

#include "drivers/arm/arm5e_settings.hpp"
#include "drivers/can/owned_descriptor.hpp"
#include "drivers/laser/relay_protocol.hpp"
#include "drivers/serial/serial_settings.hpp"

namespace tankrig {

struct GuardianSettings {
  SerialSettings laser_line;
  RelayProtocol laser;
  Arm5eSettings arm;
  std::string command;           ///< what the program does, for the report
  std::filesystem::path report;  ///< written when it takes over; empty: told on the terminal alone
  bool emulated = false;         ///< the devices end with the program: nobody is asked once they have gone too
  int priority = 90;             ///< of SCHED_FIFO, above the cycle's
};

/// How an operator tells a guardian that goes on asking: to the letter.
inline constexpr char kPowerIsCut[] = "the power is cut";

/// A line's descriptor comes with this byte.
enum class GuardianLine : std::uint8_t { kLaser, kArm };

/// Runs until the program that holds the other end of `control` has ended in order, or both devices confirm, or an
/// operator acknowledges (SIGUSR1). It takes its serial lines from there, and opens its own CAN socket. Once they are
/// all there it sends a byte back, and from then on allocates nothing; its memory is locked, and it has SCHED_FIFO and
/// the lowest score for the out-of-memory killer, where the system allows. A second thread tells: terminal and disk
/// never hold up the first. Every other signal that can be blocked is.
/// Returns the exit code: 0 after an orderly end, 3 if it took over and both confirmed, 1 if nothing was confirmed.
/// Errors: InputError before the byte.
int run_guardian(const GuardianSettings& settings, OwnedDescriptor control, OwnedDescriptor memory);

}  // namespace tankrig
