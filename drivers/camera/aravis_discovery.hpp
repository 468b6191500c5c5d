// Finding a camera by its serial number or address, and saying what was found instead.
#pragma once

#include "drivers/camera/aravis_camera.hpp"
#include "drivers/camera/aravis_object.hpp"

namespace tankrig {

/// Opened and under our control.  Errors: InputError: not found (with what was), or controlled by another program.
ArvPtr<ArvCamera> open_aravis_camera(const AravisSettings& settings);

/// True if a GigE Vision device answers at the address within `timeout`. Asks beside Aravis, whose own answer to a
/// vanished camera takes seconds.
bool gige_device_answers(const std::string& address, Duration timeout);

}  // namespace tankrig
