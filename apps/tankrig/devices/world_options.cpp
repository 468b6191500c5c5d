#include "apps/tankrig/devices/world_options.hpp"

#include "apps/tankrig/command_line/number_in.hpp"
#include "core/text_files.hpp"

namespace tankrig::app {

void add_world_options(CLI::App* command, sim::WorldOptions& world) {
  command->add_option("--light", world.light, "Simulated ambient light: 0 is darkness, 1 the reference")
      ->check(number_in(kLightRange));
  command->add_option("--noise", world.noise, "Simulated camera noise: standard deviation as a share of full scale")
      ->check(number_in(kNoiseRange));
  command->add_option("--sensor", world.sensor, "Simulated sensor model")->check(CLI::IsMember(kSensors));
  command->add_option("--particles", world.particles_per_m3, "Simulated particles per cubic metre of water")
      ->check(number_in(kParticlesRange));
  command
      ->add_option("--board", world.boards, "Simulated calibration board of the scene that is there; may be repeated")
      ->allow_extra_args(false);
  command->add_option("--truth-seed", world.truth_seed,
                      "Seed of the rig file's `truth`, how a simulated rig was built");
  command->add_option("--seed", world.seed, "Seed of all random numbers")->capture_default_str();
}

std::vector<std::string> option_words(const sim::WorldOptions& world) {
  std::vector<std::string> words;
  const auto add = [&](const char* option, const std::string& value) { words.insert(words.end(), {option, value}); };
  if (world.light) add("--light", exact_text(*world.light));
  if (world.noise) add("--noise", exact_text(*world.noise));
  if (world.sensor) add("--sensor", *world.sensor);
  if (world.particles_per_m3) add("--particles", exact_text(*world.particles_per_m3));
  for (const std::string& board : world.boards) add("--board", board);
  if (world.truth_seed) add("--truth-seed", std::to_string(*world.truth_seed));
  return words;
}

}  // namespace tankrig::app
