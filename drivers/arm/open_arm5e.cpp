// The real arm on the carrier its settings name.
#include "drivers/arm/arm5e.hpp"
#include "drivers/arm/serial_arm_link.hpp"

namespace tankrig {
namespace {

JointSet driven_by(const HomingSettings& homing) {
  JointSet driven = 0;
  for (std::size_t j = 0; j < kJoints; ++j)
    if (homing.direction[j] != HomeDirection::kNone) driven |= only(j);
  return driven;
}

}  // namespace

std::unique_ptr<Arm5e> open_arm5e(const Arm5eSettings& settings, const ArmModel& model, const Clock& clock) {
  check_carrier_load(settings);
  std::optional<ZeroProof> proof;
  if (!settings.zero_file.empty()) proof.emplace(settings.zero_file, driven_by(settings.homing));
  std::unique_ptr<ArmLink> link;
  if (settings.carrier == ArmCarrier::kCan)
    link = std::make_unique<CanArmLink>(open_can(settings.can, clock), settings.can_ids, settings.can.bitrate,
                                        settings.encoder_latency);
  else
    link = std::make_unique<SerialArmLink>(SerialPort(settings.serial), settings.encoder_latency);
  auto arm = std::make_unique<Arm5e>(settings, model, std::move(link), clock);
  if (proof) arm->set_proof(std::move(*proof));
  (void)arm->stop();  // whoever drove it last may have been killed
  return arm;
}

}  // namespace tankrig
