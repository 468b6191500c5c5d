// The real arm on the carrier its settings name.
#include "drivers/arm/arm5e.hpp"
#include "drivers/arm/serial_arm_link.hpp"

namespace tankrig {

std::unique_ptr<Arm5e> open_arm5e(const Arm5eSettings& settings, const ArmModel& model, const Clock& clock) {
  check_carrier_load(settings);
  std::optional<ArmZero> zero;
  if (!settings.zero_file.empty() && std::filesystem::exists(settings.zero_file))
    zero = load_arm_zero(settings.zero_file);
  std::unique_ptr<ArmLink> link;
  if (settings.carrier == ArmCarrier::kCan)
    link = std::make_unique<CanArmLink>(open_can(settings.can, clock), settings.can_ids, settings.can.bitrate,
                                        settings.encoder_latency);
  else
    link = std::make_unique<SerialArmLink>(SerialPort(settings.serial), settings.encoder_latency);
  auto arm = std::make_unique<Arm5e>(settings, model, std::move(link), clock);
  (void)arm->stop();  // whoever drove it last may have been killed
  if (zero) arm->set_zero(*zero);
  return arm;
}

}  // namespace tankrig
