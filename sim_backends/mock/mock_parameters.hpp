// How the mock devices behave: the rig file's `mock` section.
#pragma once

#include <array>

#include "core/arm_model.hpp"
#include "core/config_node.hpp"
#include "core/time.hpp"
#include "sim_backends/world/arm_plant.hpp"

namespace tankrig::sim {

/// Source of the defaults: the laboratory's public controller (docs/reference/arm5e.md); time constant and latency are
/// assumptions.
struct MockArmParameters {
  Duration exchange_period = std::chrono::milliseconds{10};  ///< set-point out, encoders back
  Duration feedback_latency = std::chrono::milliseconds{5};  ///< from reading the encoders to try_read
  bool latency_known = true;  ///< the driver takes the latency off the stamp; else a state is stamped on arrival
  Duration watchdog = std::chrono::milliseconds{500};  ///< without a set-point for longer the arm stops
  double time_constant = 0.03;                         ///< first-order lag of every actuator's velocity [s]
  double creep = 0.01;                                 ///< slower commands are rest [rad/s]
  JointVector dead_zone = (JointVector() << 0.06, 0.06, 0.06, 0.2, 0.1)
                              .finished();             ///< slower commands, but for creep, are raised to it [rad/s]
  double max_ticks_per_s = 2000;                       ///< all axes are slowed together when one exceeds it
  std::array<double, kJoints> backlash_ticks{};        ///< total backlash between encoder and link
  std::array<double, kJoints> stiction_ticks_per_s{};  ///< slower demands move nothing
  std::array<double, kJoints> speed_gain = ArmPlantParameters::unit_gain();  ///< speed per demand of every actuator
};

struct MockCameraParameters {
  Duration exposure = std::chrono::milliseconds{10};
  Duration phase = Duration{0};                     ///< mid-exposures are at start-up + phase + n / rate
  Duration readout = std::chrono::milliseconds{8};  ///< from the end of the exposure to try_grab
  int drop_every = 0;                               ///< every n-th frame is lost on the wire; 0: none
  int buffer_frames = 8;                            ///< frames that wait for try_grab; older ones are overrun
  bool triggered = false;     ///< exposes at trigger() only; set from the rig's camera, not from the mock section
  Duration trigger_delay{0};  ///< from trigger() to the start of the exposure
  Duration stamp_offset{0};   ///< added to every stamp: what `calibrate time` must find
};

struct MockParameters {
  MockArmParameters arm;
  MockCameraParameters camera;  ///< of every camera
  Duration laser_warm_up = std::chrono::seconds{1};
  double lux_relative_noise = 0;  ///< one standard deviation of a reading, relative
};

/// The rig file's `mock`.
extern const SettingsTable<MockParameters> kMockKeys;

}  // namespace tankrig::sim
