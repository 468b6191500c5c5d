// What a simulated or emulated tank is like, on the command line.
#pragma once

#include <string>
#include <vector>

#include "apps/tankrig/command_line/command_line.hpp"
#include "core/config_node.hpp"
#include "sim_backends/world/tank_world.hpp"

namespace tankrig::app {

inline constexpr ConfigRange kLightRange{0, 1}, kNoiseRange{0, 0.1}, kParticlesRange{0, 1e5};
inline const std::vector<std::string> kSensors{"gaussian", "emva1288"};

void add_world_options(CLI::App* command, sim::WorldOptions& world);

/// They, all but --seed, as they are typed.
std::vector<std::string> option_words(const sim::WorldOptions& world);

}  // namespace tankrig::app
