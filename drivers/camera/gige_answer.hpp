// Whether a GigE Vision camera is reachable.
#pragma once

#include <string>

#include "core/time.hpp"

namespace tankrig {

/// True if a GigE Vision device at the address answers within `timeout`. Bypasses Aravis, which takes seconds for a
/// vanished camera.
bool gige_device_answers(const std::string& address, Duration timeout);

}  // namespace tankrig
