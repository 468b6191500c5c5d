// The rig file's `obstacles` section, without cameras and object.
#pragma once

#include "core/settings_table.hpp"
#include "rig/plan/obstacles.hpp"

namespace tankrig {

extern const SettingsTable<Obstacles> kObstacleKeys;

}  // namespace tankrig
