// Whether a calibration still holds, by a sweep over the object it was made with: its shape is known.
#pragma once

#include <optional>
#include <vector>

#include "apps/tankrig/command_line/progress.hpp"
#include "core/calibration_file.hpp"
#include "core/frames.hpp"
#include "session/reading/session.hpp"

namespace tankrig::app {

struct ObjectChecks {
  std::vector<CalibrationCheck> checks;
  /// From where the rig has the object to where laser and stereo see it; nothing if they do not. Says as much about the calibration as
  /// the object's stillness since does: no check.
  /// Frames: o.
  std::optional<Transform> moved;
};

/// Each method's points, off the object that is laid over them, and how far the two objects then are apart.
/// Errors: InputError if too little of the object is seen to tell where it is.
ObjectChecks object_checks(const Session& session, Progress& progress);

}  // namespace tankrig::app
