// `tankrig arm stop`: laser off and arm at rest, whoever left them how.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/arm/arm_motion.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/command_line/stop.hpp"

namespace tankrig::app {
namespace {

/// Says why not, where it is not confirmed.
bool is_dark(Backend& backend, const RigConfig& rig, Progress& progress) {
  if (!backend.laser_unknown().empty()) {
    progress.warn(backend.laser_unknown());
    return false;
  }
  try {
    make_laser_dark(backend, rig.scan);
    return true;
  } catch (const std::exception& e) {
    progress.warn(e.what());
    return false;
  }
}

}  // namespace

/// It can neither move nor light, so it needs no guardian, and a laser that cannot be opened does not keep the arm from
/// being stopped.
int arm_stop(const ArmCommandOptions& options) {
  Progress progress;
  const RigConfig rig = load_rig(find_rig(options.rig));
  const StopOnSignal stop_on_signal;  // before the devices: it outlives them
  const OwnBackend backend =
      make_backend(rig, {.carrier = options.carrier, .need = {.laser = false, .cameras = false}});
  EndState left;
  left.laser_dark = is_dark(*backend, rig, progress);
  left.arm_at_rest = came_to_rest(
      *backend, from_seconds(rig.scan.safety.rest_timeout), [&] { return backend->arm().stop().ok(); }, [](bool) {});
  if (options.json)
    print_json({{"laser_dark", left.laser_dark}, {"arm_at_rest", left.arm_at_rest}});
  else if (left.safe())
    std::printf("%s\n", to_string(left).c_str());
  if (left.safe()) return kOk;
  progress.warn(to_string(left));
  return kFailure;
}

}  // namespace tankrig::app
