// What goes wrong, when and for how long: one file and one vocabulary for every device of a rig.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/config_node.hpp"
#include "core/time.hpp"

namespace tankrig::sim {

enum class FaultDevice : std::uint8_t { kArm, kCamera, kLaser, kBeam, kLuxMeter, kInterlock, kDisk, kSupervisor };
const char* to_string(FaultDevice device) noexcept;

/// The first seven are PX4's words for failures.
enum class FaultKind : std::uint8_t {
  kOff,
  kStuck,
  kGarbage,
  kWrong,
  kSlow,
  kDelayed,
  kIntermittent,
  kBusOff,
  kEnobufs,
  kUnplugged,
  kDropped,
  kTorn,
  kClockJump,
  kDiskFull,
  kWriteError,
};
const char* to_string(FaultKind kind) noexcept;

/// The origin of a fault's time.
enum class FaultOrigin : std::uint8_t {
  kStart,    ///< the devices have been opened
  kMotion,   ///< the arm's first set-point that is not rest
  kLaserOn,  ///< the laser's first command to shine
  kPhase,    ///< the scan enters a phase
};

struct FaultSpec {
  FaultDevice device = FaultDevice::kArm;
  std::string camera;  ///< of kCamera: its name; empty: every camera
  FaultKind kind = FaultKind::kOff;
  FaultOrigin origin = FaultOrigin::kStart;
  std::string phase;    ///< of kPhase: how the phase's name begins, e.g. "sweep pass 1"
  Duration at{};        ///< after the origin
  Duration duration{};  ///< 0: lasts
  double ratio = 0.5;   ///< share of the messages or periods concerned; a speed; see the table
  Duration period = std::chrono::milliseconds{200};  ///< of intermittent faults
  Duration delay = std::chrono::milliseconds{300};   ///< of what is late
  double amount = 0.2;                               ///< of what is wrong: radians, or a factor
  Duration jump = std::chrono::milliseconds{500};    ///< of a clock
  std::uint64_t seed = 1;

  /// "camera mono: unplugged"
  std::string name() const;
};

/// An existing combination and its effect; docs/reference/faults.md tells the same by kind.
struct FaultOffer {
  FaultDevice device;
  FaultKind kind;
  bool mock;  ///< in this process, on the drivers' interfaces
  bool wire;  ///< on the emulated wires
  const char* what;
};
std::span<const FaultOffer> fault_offers() noexcept;

enum class FaultLevel : std::uint8_t { kMock, kWire };

struct FaultPlan {
  std::vector<FaultSpec> faults;

  /// `faults:`, a list of mappings: docs/reference/faults.md.
  /// Errors: InputError with file and line, also for what a device does not offer.
  static FaultPlan load(const std::filesystem::path& file);
  static FaultPlan from(const ConfigNode& node);
  /// The same for a rig with these cameras. Also refused: faults that do not exist at that level, and cameras the rig
  /// does not have.
  static FaultPlan load(const std::filesystem::path& file, FaultLevel level, const std::vector<std::string>& cameras);

  /// Errors: InputError, one line that lists what the device offers, if a fault does not exist there.
  void check(FaultLevel level) const;
  /// As load() reads it, with every default.
  std::string yaml() const;
};

/// Uniform in [0, 1), the same on every machine: a hash of seed and number.
/// RT: safe.
double fault_chance(std::uint64_t seed, std::uint64_t number) noexcept;

}  // namespace tankrig::sim
