// Finds a camera by serial number or address, and says what was found instead.
#pragma once

#include "drivers/camera/aravis_camera.hpp"
#include "drivers/camera/aravis_object.hpp"
#include "drivers/camera/gige_answer.hpp"

namespace tankrig {

/// Opened and under our control.
/// Errors: InputError: not found (with what was), or controlled by another program.
ArvPtr<ArvCamera> open_aravis_camera(const AravisSettings& settings);

}  // namespace tankrig
