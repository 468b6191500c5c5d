#include "apps/tankrig/experiment/light_operator.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <optional>

#include "apps/tankrig/command_line/confirm.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/devices/scene_check.hpp"
#include "apps/tankrig/scan/shown_scan.hpp"
#include "core/input_error.hpp"
#include "core/text_files.hpp"

namespace tankrig::app {
namespace {

std::string wanted(const LuxLevel& level) { return fmt::format("{:g} lx (+-{:.2g})", level.lux, level.margin()); }

}  // namespace

LightOperator::LightOperator(const RigConfig& rig, sim::WorldOptions world, Progress& progress)
    : rig_(rig), progress_(progress) {
  if (rig.scene.empty()) return;
  world.light = 1;
  most_lux_ = load_world(rig, world).lux();
}

void LightOperator::check(const LuxLevel& level) const {
  if (most_lux_ && level.lux > *most_lux_)
    throw InputError(
        rig_.scene, fmt::format("its brightest light is {:.1f} lx at the lux meter, expected at least {:g}", *most_lux_,
                                level.lux));
}

void LightOperator::set(const LuxLevel& level, ScanOptions& scan) const {
  if (most_lux_)
    scan.world.light = *most_lux_ > 0 ? level.lux / *most_lux_ : 0;
  else if (rig_.scan.capture.read_lux)
    wait_for_meter(level, scan.command);
  else
    scan.lux = typed(level);
}

void LightOperator::wait_for_meter(const LuxLevel& level, const std::string& command) const {
  BackendOptions lux_alone;
  lux_alone.need = {.arm = false, .laser = false, .cameras = false, .lux_meter = true};
  lux_alone.command = command;
  const OwnBackend backend = make_backend(rig_, lux_alone);
  if (!backend->laser_unknown().empty()) progress_.warn(backend->laser_unknown());
  progress_.note("set the light to " + wanted(level) + " at the lux meter; the scan begins when it reads that");
  const auto found = wait_for_level(
      backend->lux_meter(), backend->clock(), level, StopOnSignal::requested(), [&](const Result<LuxReading>& reading) {
        if (reading.ok()) show_lux(reading.value().lux, "meter");
        progress_.update(
            "light for " + wanted(level), 0,
            reading.ok() ? fmt::format("now {:.1f} lx", reading.value().lux) : std::string(reading.error().where));
      });
  progress_.finish_line();
  if (!found) throw StoppedEarly("stopped before the light was set: nothing moved");
  progress_.note(fmt::format("the lux meter reads {:.1f} lx", *found));
}

std::string LightOperator::typed(const LuxLevel& level) const {
  if (isatty(STDIN_FILENO) == 0)
    throw InputError(rig_.file,
                     "scan: read_lux is false and standard input is no terminal, expected a lux meter or "
                     "somebody to type what it reads");
  while (true) {
    std::fprintf(stderr, "Set the light to %s. What does your lux meter read [lx]? ", wanted(level).c_str());
    const std::optional<std::string> reading = typed_line();
    if (!reading) {
      if (StopOnSignal::requested()) throw StoppedEarly("stopped before the light was set: nothing moved");
      throw InputError("no reading was typed: nothing was done");
    }
    try {
      check_lux(*reading);
      if (*reading != "auto" && level.holds(std::stod(*reading))) return *reading;
      std::fprintf(stderr, "found %s, expected %s\n", reading->c_str(), wanted(level).c_str());
    } catch (const InputError&) {
      std::fprintf(stderr, "expected a number\n");
    }
  }
}

}  // namespace tankrig::app
