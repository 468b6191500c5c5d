#include "drivers/can/can_bus.hpp"

namespace tankrig {

const char* to_string(CanState state) noexcept {
  switch (state) {
    case CanState::kErrorActive:
      return "error-active";
    case CanState::kErrorWarning:
      return "error-warning";
    case CanState::kErrorPassive:
      return "error-passive";
    case CanState::kBusOff:
      return "bus-off";
    case CanState::kDown:
      return "down";
    case CanState::kGone:
      return "gone";
  }
  return "?";
}

Statistics statistics_of(const CanCounters& c, CanState state) {
  const auto value = [](std::uint64_t count) { return static_cast<double>(count); };
  return {{"can_sent", value(c.sent)},
          {"can_received", value(c.received)},
          {"can_send_buffer_full", value(c.send_buffer_full)},
          {"can_receive_dropped", value(c.receive_dropped)},
          {"can_foreign", value(c.foreign)},
          {"can_error_frames", value(c.error_frames)},
          {"can_bus_off", value(c.bus_off)},
          {"can_restarted", value(c.restarted)},
          {"can_no_ack", value(c.no_ack)},
          {"can_lost_arbitration", value(c.lost_arbitration)},
          {"can_bus_errors", value(c.bus_errors)},
          {"can_send_timeouts", value(c.send_timeouts)},
          {"can_controller_overflow", value(c.controller_overflow)},
          {"can_reopened", value(c.reopened)},
          {"can_state", static_cast<double>(state)}};
}

}  // namespace tankrig
