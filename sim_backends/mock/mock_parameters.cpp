#include "sim_backends/mock/mock_parameters.hpp"

#include "core/settings_table.hpp"

namespace tankrig::sim {
namespace {

constexpr ConfigRange kNotNegative{0, 1e6}, kPositive{1e-9, 1e6};

const Setting<MockArmParameters> kMockArmRows[] = {
    {"exchange_period_ms", &MockArmParameters::exchange_period, ConfigRange(0.1, 1000), "set-point out, encoders back"},
    {"feedback_latency_ms", &MockArmParameters::feedback_latency, ConfigRange(0, 500),
     "from reading the encoders to the joint state"},
    {"latency_known", &MockArmParameters::latency_known,
     "the stamp is when the encoders were read; false: when the state arrived"},
    {"watchdog_ms", &MockArmParameters::watchdog, kPositive, "without a set-point for longer the arm stops"},
    {"time_constant_s", &MockArmParameters::time_constant, kPositive, "first-order lag of every actuator's velocity"},
    {"creep_rad_s", &MockArmParameters::creep, kNotNegative, "slower commands are rest"},
    {"max_ticks_per_s", &MockArmParameters::max_ticks_per_s, kPositive,
     "all axes are slowed together when one exceeds it"},
    {"dead_zone_rad_s", &MockArmParameters::dead_zone, kNotNegative,
     "slower commands, but for creep, are raised to it"},
    {"backlash_ticks", &MockArmParameters::backlash_ticks, kNotNegative, "between encoder and link, from end to end"},
    {"stiction_ticks_per_s", &MockArmParameters::stiction_ticks_per_s, kNotNegative, "slower demands move nothing"},
    {"speed_gain", &MockArmParameters::speed_gain, kNotNegative, "speed per demand of every actuator"},
};
constexpr SettingsTable<MockArmParameters> kMockArm{kMockArmRows};

const Setting<MockCameraParameters> kMockCameraRows[] = {
    {"exposure_ms", &MockCameraParameters::exposure, kPositive, "of no effect where the scene says it"},
    {"phase_ms", &MockCameraParameters::phase, kNotNegative, "mid-exposures are at start-up + phase + n / rate"},
    {"readout_ms", &MockCameraParameters::readout, kNotNegative, "from the end of the exposure to the frame"},
    {"drop_every", &MockCameraParameters::drop_every, ConfigRange(0, 1e6),
     "every n-th frame is lost on the wire; 0: none"},
    {"buffer_frames", &MockCameraParameters::buffer_frames, ConfigRange(1, 1000),
     "frames that wait; older ones are overrun"},
    {"trigger_delay_ms", &MockCameraParameters::trigger_delay, kNotNegative,
     "from trigger to the start of the exposure"},
    {"stamp_offset_ms", &MockCameraParameters::stamp_offset, ConfigRange(-1000, 1000),
     "added to every stamp: what `calibrate time` must find"},
};
constexpr SettingsTable<MockCameraParameters> kMockCamera{kMockCameraRows};

const Setting<MockParameters> kMockLaserRows[] = {
    {"warm_up_ms", &MockParameters::laser_warm_up, kNotNegative, "from supply to light"},
};
constexpr SettingsTable<MockParameters> kMockLaser{kMockLaserRows};
const Setting<MockParameters> kMockLuxRows[] = {
    {"relative_noise", &MockParameters::lux_relative_noise, ConfigRange(0, 1), "one standard deviation of a reading"},
};
constexpr SettingsTable<MockParameters> kMockLux{kMockLuxRows};

const Setting<MockParameters> kMockRows[] = {
    {"arm", &MockParameters::arm, kMockArm},
    {"camera", &MockParameters::camera, kMockCamera},
    {"laser", kMockLaser},
    {"lux_meter", kMockLux},
};

}  // namespace

constinit const SettingsTable<MockParameters> kMockKeys{kMockRows};

}  // namespace tankrig::sim
