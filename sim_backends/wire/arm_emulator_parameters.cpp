#include "sim_backends/wire/arm_emulator_parameters.hpp"

#include "core/settings_table.hpp"

namespace tankrig::sim {
namespace {

constexpr ConfigRange kProbability{0, 1}, kAmperes{0, 20}, kDelay_ms{0, 500}, kNotNegative{0, 1e6};

const Setting<ArmPlantParameters> kPlantRows[] = {
    {"backlash_ticks", &ArmPlantParameters::backlash_ticks, kNotNegative, "between encoder and link, from end to end"},
    {"stiction_ticks_per_s", &ArmPlantParameters::stiction_ticks_per_s, kNotNegative, "slower demands move nothing"},
    {"speed_gain", &ArmPlantParameters::speed_gain, kNotNegative, "ticks/s an actuator makes of a demand of 1 ticks/s"},
    {"time_constant_s", &ArmPlantParameters::time_constant, {1e-4, 10}, "first-order lag of every actuator's velocity"},
    {"quiescent_a", &ArmPlantParameters::quiescent_a, kAmperes, "the whole arm at rest"},
    {"stall_a", &ArmPlantParameters::stall_a, kAmperes, "of an axis that pushes against its stop"},
    {"current_a_per_tick_s", &ArmPlantParameters::current_a_per_tick_s, ConfigRange(0, 1), "of a moving axis"},
};
constexpr SettingsTable<ArmPlantParameters> kPlant{kPlantRows};

using Emulated = ArmEmulatorParameters;
const Setting<Emulated> kArmEmulatorRows[] = {
    {"power_up_rad", &Emulated::power_up, ConfigRange(-7, 7), "posture when the supply comes on"},
    {"power_up_ticks", &Emulated::power_up_ticks, ConfigRange(-1e6, 1e6),
     "what the encoders read then; 1000 each where `homed`"},
    {"", &Emulated::plant, kPlant},
    {"watchdog_ms", &Emulated::watchdog, ConfigRange(0, 60'000),
     "without a request for longer the axes rest; 0: never"},
    {"turnaround_ms", &Emulated::turnaround, kDelay_ms, "from a request's last bit to reading the encoders"},
    {"encoder_latency_ms", &Emulated::encoder_latency, kDelay_ms, "from there to the answer's first bit"},
    {"can_paced", &Emulated::can_paced, "frames take their time though the bus does not"},
    {"serial_paced", &Emulated::serial_paced, "bytes take their time, which a pseudo-terminal does not"},
    {"needs_gains", &Emulated::needs_gains, "no axis moves before PID gains have come"},
    {"mute_on_0a", &Emulated::mute_on_0a, "a demand whose low byte is 0x0A makes it mute"},
    {"mute_probability", &Emulated::mute_probability, kProbability,
     "of going mute at a request, until a different one comes"},
    {"zero_peak_probability", &Emulated::zero_peak_probability, kProbability, "of reading 0 from an encoder"},
    {"supply_v", &Emulated::supply_v, ConfigRange(0, 54), "as the master tells it"},
    {"temperature_c", &Emulated::temperature_c, ConfigRange(0, 400), "likewise"},
    {"seed", &Emulated::seed, ConfigRange(0, 2e9), "of its random habits"},
};

}  // namespace

constinit const SettingsTable<ArmEmulatorParameters> kArmEmulatorKeys{kArmEmulatorRows};

}  // namespace tankrig::sim
