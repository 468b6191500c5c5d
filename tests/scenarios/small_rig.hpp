// A small mock rig with a fault plan, scanned in virtual time into a session on disk.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "rig/scan/before_start.hpp"
#include "rig/scan/scan.hpp"
#include "sim_backends/faults/fault_plan.hpp"
#include "tests/scenarios/call_tape.hpp"

namespace tankrig::scenarios {

struct TimedText {
  Stamp when{};
  std::string kind, text;
};

/// How one scan went.
struct Outcome {
  std::string status;  ///< of the scan, or what it threw
  std::string lux;     ///< the lux meter after the scan: a value, or its error
  EndState left;
  FrameCounts counts;
  std::map<std::string, CameraAccount> account;
  std::vector<TimedText> events;
  Stamp begun{};  ///< when the plan's first fault began
  bool has_begun = false;
  std::optional<Reaction> reaction;  ///< nothing: nothing stopped the scan
  bool beam_left_on = false;         ///< the light itself, not what anybody says about it
  double moving = 0;                 ///< fastest joint, in truth, when `left` was said [rad/s]
  double simulated_s = 0;
  /// Largest, of a recorded frame's stamp against its exposure; nothing: of no frame it is known when it was exposed.
  std::optional<Duration> stamp_error;

  bool stopped() const { return status != "complete"; }
  bool told(const std::string& words) const;
};

/// Cameras: mono (sweep and dark blocks), left (dark blocks), 25 frames/s. Cycle: 200 Hz. `session` is made.
Outcome scan_with_faults(const sim::FaultPlan& plan, const std::filesystem::path& session,
                         cv::Size picture = {320, 240});

/// A dark floor with a sensor's noise; three rows shine, 1: all of the laser's light.
cv::Mat stripe_picture(cv::Size size, double light, std::uint64_t index);

/// Seconds per cycle of the small rig.
inline constexpr double kCyclePeriod = 0.005;

}  // namespace tankrig::scenarios
