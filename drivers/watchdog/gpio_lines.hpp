// A watchdog box on two lines of a GPIO chip, by libgpiod.
#pragma once

#include <memory>
#include <string>

#include "drivers/watchdog/watchdog_lines.hpp"

namespace tankrig {

struct GpioPlace {
  std::string chip;  ///< /dev/gpiochip0
  int line = -1;     ///< its offset on the chip
};

/// Toggles the line; low until the first edge.
/// `key`: of the rig file, for messages.
/// Errors: InputError for a chip or a line that is absent or used by somebody else.
std::shared_ptr<HeartbeatLine> open_gpio_heartbeat(const GpioPlace& place, const std::string& key);

/// Its level, with the chip's own pull away from "enabled" where it has one.
/// Errors: likewise.
std::shared_ptr<EnableLine> open_gpio_enable(const GpioPlace& place, bool closed_is_on, const std::string& key);

}  // namespace tankrig
