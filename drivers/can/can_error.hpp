// CAN error frames: what the controller tells about the bus, decoded.
#pragma once

#include <linux/can.h>

#include <cstdint>
#include <optional>

#include "drivers/can/can_bus.hpp"

namespace tankrig {

/// Layout: linux/can/error.h and Documentation/networking/can.rst of the Linux kernel.
struct CanErrorReport {
  /// The fault confinement state in the frame, if any: bus-off, restarted (error-active), the controller's state bits,
  /// or else its error counters.
  std::optional<CanState> state;
  bool bus_off = false;
  bool restarted = false;         ///< after bus-off, by restart-ms or by hand
  bool no_ack = false;            ///< nobody else on the bus, or at another bit rate
  bool lost_arbitration = false;  ///< bit number not kept
  bool receive_overflow = false;  ///< the controller's, not the socket's
  bool transmit_overflow = false;
  bool bus_error = false;  ///< bit, form, stuff or CRC error, or a transceiver's
  bool transmit_timeout = false;
  std::optional<std::uint8_t> transmit_errors, receive_errors;  ///< counters, where the frame carries them
};

/// Empty for a frame that is no error frame.
/// RT: safe.
CanErrorReport decode_error_frame(const can_frame& frame) noexcept;

}  // namespace tankrig
