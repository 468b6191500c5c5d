#include "apps/tankrig/experiment/light_operator.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>

#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/devices/scene_check.hpp"
#include "core/input_error.hpp"
#include "core/text_files.hpp"

namespace tankrig::app {
namespace {

std::string wanted(const LuxLevel& level) { return fmt::format("{:g} lx (+-{:.2g})", level.lux, level.margin()); }

}  // namespace

LightOperator::LightOperator(const RigConfig& rig, const ScanOptions& options, Progress& progress)
    : rig_(rig), options_(options), progress_(progress) {
  if (rig.scene.empty()) return;
  sim::WorldOptions bright = options.world;
  bright.light = 1;
  most_lux_ = load_world(rig, bright).lux();
}

void LightOperator::check(const LuxLevel& level) const {
  if (most_lux_ && level.lux > *most_lux_)
    throw InputError(
        rig_.scene, fmt::format("its brightest light is {:.1f} lx at the lux meter, expected at least {:g}", *most_lux_,
                                level.lux));
}

std::optional<ScanOptions> LightOperator::set(const LuxLevel& level) const {
  if (!most_lux_) return rig_.scan.capture.read_lux ? asked(level) : typed(level);
  ScanOptions options = options_;
  options.world.light = *most_lux_ > 0 ? level.lux / *most_lux_ : 0;
  return options;
}

std::optional<ScanOptions> LightOperator::asked(const LuxLevel& level) const {
  BackendOptions lux_alone;
  lux_alone.need = {.arm = false, .laser = false, .cameras = false, .lux_meter = true};
  lux_alone.command = options_.command;
  const OwnBackend backend = make_backend(rig_, lux_alone);
  progress_.note("set the light to " + wanted(level) + " at the lux meter; the scan begins when it reads that");
  const auto found = wait_for_level(
      backend->lux_meter(), backend->clock(), level, StopOnSignal::requested(), [&](const Result<LuxReading>& reading) {
        progress_.update(
            "light for " + wanted(level), 0,
            reading.ok() ? fmt::format("now {:.1f} lx", reading.value().lux) : std::string(reading.error().where));
      });
  progress_.finish_line();
  if (!found) return std::nullopt;
  progress_.note(fmt::format("the lux meter reads {:.1f} lx", *found));
  return options_;
}

ScanOptions LightOperator::typed(const LuxLevel& level) const {
  if (isatty(STDIN_FILENO) == 0)
    throw InputError(rig_.file,
                     "scan: read_lux is false and standard input is no terminal, expected a lux meter or "
                     "somebody to type what it reads");
  ScanOptions options = options_;
  for (;;) {
    std::fprintf(stderr, "Set the light to %s. What does your lux meter read [lx]? ", wanted(level).c_str());
    if (!std::getline(std::cin, options.lux)) throw InputError("no reading was typed: nothing was done");
    try {
      check_lux(options.lux);
      if (options.lux != "auto" && level.holds(std::stod(options.lux))) return options;
      std::fprintf(stderr, "found %s, expected %s\n", options.lux.c_str(), wanted(level).c_str());
    } catch (const InputError&) {
      std::fprintf(stderr, "expected a number\n");
    }
  }
}

}  // namespace tankrig::app
