// What a simulated or emulated tank is like, on the command line.
#pragma once

#include <string>
#include <vector>

#include "apps/tankrig/command_line/command_line.hpp"
#include "sim_backends/world/tank_world.hpp"

namespace tankrig::app {

void add_world_options(CLI::App* command, sim::WorldOptions& world);

/// They, all but --seed, as they are typed.
std::vector<std::string> option_words(const sim::WorldOptions& world);

}  // namespace tankrig::app
