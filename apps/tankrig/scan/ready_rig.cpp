#include "apps/tankrig/scan/ready_rig.hpp"

#include <fmt/core.h>

#include "apps/tankrig/command_line/commissioned.hpp"
#include "apps/tankrig/scan/plan_check.hpp"
#include "core/input_error.hpp"
#include "rig/scan/before_start.hpp"

namespace tankrig::app {
namespace {

BackendOptions backend_options(const ScanOptions& options) {
  BackendOptions devices;
  devices.world = options.world;
  devices.carrier = options.carrier;
  devices.faults = options.faults;
  devices.command = options.command;
  return devices;
}

}  // namespace

ReadyRig::ReadyRig(const ScanOptions& options, const RigConfig& rig, const std::filesystem::path& session,
                   const PlanFrom& plan_from, Progress& progress)
    : commission_(require_commission(rig, options.waived)), backend_(make_backend(rig, backend_options(options))) {
  for (const std::string& warning : backend_->warnings()) progress.warn(warning);
  for (const Statistic& s : backend_->statistics())
    if (s.name == "arm.bus_load_percent")
      progress.note(fmt::format("arm: its wire is busy for {:.0f} % of the time", s.value));
  plan_ = plan_from(homed_posture(*backend_, options.rig));
  check_plan(rig, *plan_);
  if (std::filesystem::exists(session)) throw InputError(session, "exists already, expected a new session directory");
  check_room(rig, *plan_, session);
  if (plan_->uses_laser()) check_laser_ready(rig.scan, backend_->laser(), backend_->interlock_closed());
  warning_.emplace(rig, *backend_, what_will_happen(*plan_), options.yes, progress);
  stops_ = std::make_unique<RigStops>(*backend_, progress);
  if (backend_->clock().real_time()) check_real_time(rig.scan.real_time);  // refused before there is a session
  if (StopOnSignal::requested()) throw StoppedEarly(options.command + " stopped before anything moved");
  motion_.emplace(*backend_, rig.scan.safety, progress);
}

void ReadyRig::disarm() {
  stops_.reset();
  warning_.reset();
}

}  // namespace tankrig::app
