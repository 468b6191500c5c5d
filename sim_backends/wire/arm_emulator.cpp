#include "sim_backends/wire/arm_emulator.hpp"

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

}  // namespace tankrig::sim
