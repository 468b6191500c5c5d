// Whether a GigE Vision camera is there at all.
#pragma once

#include <string>

#include "core/time.hpp"

namespace tankrig {

/// True if a GigE Vision device answers at the address within `timeout`. Asks beside Aravis, whose own answer to a
/// vanished camera takes seconds.
bool gige_device_answers(const std::string& address, Duration timeout);

}  // namespace tankrig
