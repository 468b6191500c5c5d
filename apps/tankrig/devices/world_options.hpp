// What a simulated or emulated tank is like, on the command line.
#pragma once

#include "apps/tankrig/command_line/command_line.hpp"
#include "sim_backends/world/tank_world.hpp"

namespace tankrig::app {

inline void add_world_options(CLI::App* command, sim::WorldOptions& world) {
  command->add_option("--light", world.light, "Simulated ambient light: 0 is darkness, 1 the reference")
      ->check(CLI::Range(0.0, 1.0));
  command->add_option("--noise", world.noise, "Simulated camera noise: standard deviation as a share of full scale")
      ->check(CLI::Range(0.0, 0.1));
  command->add_option("--sensor", world.sensor, "Simulated sensor model")
      ->check(CLI::IsMember({"gaussian", "emva1288"}));
  command->add_option("--particles", world.particles_per_m3, "Simulated particles per cubic metre of water")
      ->check(CLI::Range(0.0, 1e5));
  command
      ->add_option("--board", world.boards, "Simulated calibration board of the scene that is there; may be repeated")
      ->allow_extra_args(false);
  command->add_option("--truth-seed", world.truth_seed,
                      "Seed of the rig file's `truth`, how a simulated rig was built");
  command->add_option("--seed", world.seed, "Seed of all random numbers")->capture_default_str();
}

}  // namespace tankrig::app
