#include "core/frame_record.hpp"

namespace tankrig {

const char* to_string(Phase phase) {
  switch (phase) {
    case Phase::kMove:
      return "move";
    case Phase::kDarkBefore:
      return "dark_before";
    case Phase::kSweep:
      return "sweep";
    case Phase::kDarkAfter:
      return "dark_after";
  }
  return "?";
}

const char* to_string(CameraRole role) {
  switch (role) {
    case CameraRole::kMono:
      return "mono";
    case CameraRole::kLeft:
      return "left";
    case CameraRole::kRight:
      return "right";
  }
  return "?";
}

}  // namespace tankrig
