#include "core/frame_record.hpp"

namespace tankrig {

const char* to_string(Phase phase) { return name_of(phase); }

const char* to_string(CameraRole role) { return name_of(role); }

}  // namespace tankrig
