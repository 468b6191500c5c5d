#include "drivers/can/can_error.hpp"

#include <linux/can/error.h>

#include <algorithm>

namespace tankrig {
namespace {

// In linux/can/error.h since 6.0; older headers lack it.
constexpr std::uint32_t kErrorCounters = 0x200;
// ISO 11898-1, fault confinement: a counter from 96 on warns, above 127 the node is passive.
constexpr std::uint8_t kWarning = 96, kPassive = 128;

CanState state_of_counters(std::uint8_t transmit, std::uint8_t receive) {
  const std::uint8_t worst = std::max(transmit, receive);
  if (worst >= kPassive) return CanState::kErrorPassive;
  return worst >= kWarning ? CanState::kErrorWarning : CanState::kErrorActive;
}

std::optional<CanState> state_of_controller(std::uint8_t bits) {
  if (bits & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) return CanState::kErrorPassive;
  if (bits & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING)) return CanState::kErrorWarning;
  if (bits & CAN_ERR_CRTL_ACTIVE) return CanState::kErrorActive;
  return std::nullopt;
}

}  // namespace

CanErrorReport decode_error_frame(const can_frame& frame) noexcept {
  CanErrorReport report;
  if (!(frame.can_id & CAN_ERR_FLAG)) return report;
  const std::uint32_t classes = frame.can_id & CAN_ERR_MASK;
  // A frame shorter than the eight bytes every driver fills carries no details.
  const bool detailed = frame.can_dlc >= CAN_ERR_DLC;
  const std::uint8_t controller = detailed && (classes & CAN_ERR_CRTL) ? frame.data[1] : 0;
  const bool protocol = classes & CAN_ERR_PROT;

  report.bus_off = classes & CAN_ERR_BUSOFF;
  report.restarted = (classes & CAN_ERR_RESTARTED) && !report.bus_off;
  report.no_ack = (classes & CAN_ERR_ACK) || (protocol && detailed && frame.data[3] == CAN_ERR_PROT_LOC_ACK);
  report.lost_arbitration = classes & CAN_ERR_LOSTARB;
  report.receive_overflow = controller & CAN_ERR_CRTL_RX_OVERFLOW;
  report.transmit_overflow = controller & CAN_ERR_CRTL_TX_OVERFLOW;
  report.bus_error = protocol || (classes & (CAN_ERR_BUSERROR | CAN_ERR_TRX));
  report.transmit_timeout = classes & CAN_ERR_TX_TIMEOUT;
  if (detailed && (classes & kErrorCounters)) {
    report.transmit_errors = frame.data[6];
    report.receive_errors = frame.data[7];
  }

  if (report.bus_off)
    report.state = CanState::kBusOff;
  else if (report.restarted)
    report.state = CanState::kErrorActive;
  else if ((report.state = state_of_controller(controller)); !report.state && report.transmit_errors)
    report.state = state_of_counters(*report.transmit_errors, *report.receive_errors);
  return report;
}

}  // namespace tankrig
