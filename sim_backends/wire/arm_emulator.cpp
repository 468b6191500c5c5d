#include "sim_backends/wire/arm_emulator.hpp"

#include "core/utc.hpp"
#include "sim_backends/wire/arm_wire.hpp"

namespace tankrig::sim {

ArmEmulator::ArmEmulator(const ArmModel& model, const ArmEmulatorParameters& parameters, Clock& clock)
    : parameters_(parameters), clock_(clock), electronics_(model, parameters, clock) {}

ArmEmulator::~ArmEmulator() = default;

void ArmEmulator::serve(std::unique_ptr<CanBus> bus) {
  wires_.push_back(make_can_wire(std::move(bus), electronics_, parameters_, clock_));
  wires_.back()->start();
}

void ArmEmulator::serve(const std::filesystem::path& line) {
  wires_.push_back(make_serial_wire(line, electronics_, parameters_, clock_));
  wires_.back()->start();
}

void ArmEmulator::unplug() {
  for (const auto& wire : wires_) wire->set_plugged(false);
}

void ArmEmulator::plug() {
  for (const auto& wire : wires_) wire->set_plugged(true);
}

ArmZero zero_as_homed(const ArmEmulator& arm, const ArmEmulatorParameters& parameters) {
  ArmZero::OrderlyExit left{{}, utc_now()};
  for (std::size_t j = 0; j < kJoints; ++j) left.raw[j] = static_cast<std::uint16_t>(parameters.power_up_ticks[j]);
  return {arm.true_zero(), utc_now(), left};
}

}  // namespace tankrig::sim
