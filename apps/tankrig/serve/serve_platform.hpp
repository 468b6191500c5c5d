// `tankrig serve --platform`: the online benchmark, without a rig.
#pragma once

#include <filesystem>

#include "apps/tankrig/command_line/command_line.hpp"
#include "console/platform/platform.hpp"

namespace tankrig::app {

struct PlatformCommand {
  bool on = false;
  std::filesystem::path datasets = "datasets", store = "platform";
  Quota quota;
  int jobs = 1;
};

void add_platform_options(CLI::App& serve, PlatformCommand& options);
int run_platform(const PlatformCommand& options, const ListenOptions& listen);

/// Below `tankrig serve`; not for people: packs what others may have of a session.
void add_publish(CLI::App& serve, ChosenCommand& chosen);

}  // namespace tankrig::app
