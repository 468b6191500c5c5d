#include "sim_backends/wire/arm_emulator_parameters.hpp"

namespace tankrig::sim {
namespace {

constexpr ConfigRange kProbability{0, 1};

template <class T>
void read_joints(const ConfigNode& node, std::string_view key, std::array<T, kJoints>& into) {
  if (!node.has(key)) return;
  const auto values = node.numbers(key, kJoints);
  for (std::size_t j = 0; j < kJoints; ++j) into[j] = static_cast<T>(values[j]);
}

}  // namespace

ArmEmulatorParameters arm_emulator_parameters_from(const ConfigNode& node) {
  ArmEmulatorParameters p;
  if (node.has("power_up_rad")) {
    const auto q = node.numbers("power_up_rad", kJoints);
    for (int j = 0; j < kJoints; ++j) p.power_up[j] = q[static_cast<std::size_t>(j)];
  }
  read_joints(node, "power_up_ticks", p.power_up_ticks);
  read_joints(node, "backlash_ticks", p.plant.backlash_ticks);
  read_joints(node, "stiction_ticks_per_s", p.plant.stiction_ticks_per_s);
  read_joints(node, "speed_gain", p.plant.speed_gain);
  p.plant.time_constant = node.number_or("time_constant_s", p.plant.time_constant, {1e-4, 10});
  p.plant.quiescent_a = node.number_or("quiescent_a", p.plant.quiescent_a, {0, 20});
  p.plant.stall_a = node.number_or("stall_a", p.plant.stall_a, {0, 20});
  p.plant.current_a_per_tick_s = node.number_or("current_a_per_tick_s", p.plant.current_a_per_tick_s, {0, 1});
  p.watchdog = node.milliseconds_or("watchdog_ms", p.watchdog, {0, 60'000});
  p.turnaround = node.milliseconds_or("turnaround_ms", p.turnaround, {0, 500});
  p.encoder_latency = node.milliseconds_or("encoder_latency_ms", p.encoder_latency, {0, 500});
  p.can_paced = node.flag_or("can_paced", p.can_paced);
  p.serial_paced = node.flag_or("serial_paced", p.serial_paced);
  p.needs_gains = node.flag_or("needs_gains", p.needs_gains);
  p.mute_on_0a = node.flag_or("mute_on_0a", p.mute_on_0a);
  p.mute_probability = node.number_or("mute_probability", p.mute_probability, kProbability);
  p.zero_peak_probability = node.number_or("zero_peak_probability", p.zero_peak_probability, kProbability);
  p.supply_v = node.number_or("supply_v", p.supply_v, {0, 54});
  p.temperature_c = node.number_or("temperature_c", p.temperature_c, {0, 400});
  p.seed = static_cast<std::uint64_t>(node.integer_or("seed", static_cast<int>(p.seed), {0, 2e9}));
  return p;
}

}  // namespace tankrig::sim
