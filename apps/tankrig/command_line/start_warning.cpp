#include "apps/tankrig/command_line/start_warning.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/tankrig/command_line/confirm.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "core/angles.hpp"
#include "core/input_error.hpp"

namespace tankrig::app {
namespace {

constexpr double kWithDevices = 3;                         // [s]
constexpr Duration kLook = std::chrono::milliseconds{50};  // at the stop flag
constexpr double kMoves = 1e-3;                            // [rad]; less is no motion that people see

}  // namespace

std::string what_will_happen(const ScanPlan& plan) {
  std::string joints;
  const auto reach = plan.reach();
  for (std::size_t j = 0; j < kJoints; ++j)
    if (reach[j].upper - reach[j].lower > kMoves)
      joints += fmt::format("{}{} {:.1f} to {:.1f} deg", joints.empty() ? "" : ", ", kJointNames[j],
                            to_degrees(reach[j].lower), to_degrees(reach[j].upper));
  double lit_s = 0;
  for (const Segment& segment : plan.segments())
    if (segment.laser) lit_s += segment.duration;
  std::string text = joints.empty()
                         ? "its arm stays at rest"
                         : fmt::format("its arm will move for {:.0f} s ({})", std::ceil(plan.duration()), joints);
  if (lit_s > 0) text += fmt::format(", and its laser will shine for {:.0f} s", std::ceil(lit_s));
  return text;
}

StartWarning::StartWarning(const RigConfig& rig, Backend& backend, const std::string& what, bool yes,
                           Progress& progress)
    : lamp_(backend.warning()) {
  const bool hurts = backend.world() == nullptr;
  if (hurts) {
    progress.note(rig.name + ": " + what);
    confirm("Is everybody out of its way, and everybody's sight protected?", yes);
  }
  if (lamp_)
    if (const Status on = lamp_->set(true); !on.ok())
      throw InputError(rig.file, "scan: safety: warning_output: " + describe(on.error()) +
                                     ", expected it to take its command: plug it in, or take it out of the rig file");
  const double warning = rig.scan.safety.start_warning.value_or(hurts ? kWithDevices : 0);
  Clock& clock = backend.clock();
  const Stamp start = clock.now() + from_seconds(warning);
  while (clock.now() < start) {
    if (StopOnSignal::requested()) {
      if (lamp_) (void)lamp_->set(false);
      throw StoppedEarly("stopped before anything moved");
    }
    const double left = seconds(start - clock.now());
    progress.update(fmt::format("starts in {:.0f} s", std::ceil(left)), 1 - left / warning);
    clock.sleep_until(std::min(start, clock.now() + kLook));
  }
}

StartWarning::~StartWarning() {
  if (lamp_) (void)lamp_->set(false);
}

}  // namespace tankrig::app
