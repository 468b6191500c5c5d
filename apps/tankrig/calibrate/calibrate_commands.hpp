// The commands below `tankrig calibrate`.
#pragma once

#include "apps/tankrig/command_line/command_line.hpp"

namespace tankrig::app {

void add_calibrate_all(CLI::App& calibrate, ChosenCommand& chosen);
void add_calibrate_camera(CLI::App& calibrate, ChosenCommand& chosen);
void add_calibrate_check(CLI::App& calibrate, ChosenCommand& chosen);
void add_calibrate_convert(CLI::App& calibrate, ChosenCommand& chosen);
void add_calibrate_hand_eye(CLI::App& calibrate, ChosenCommand& chosen);
void add_calibrate_laser(CLI::App& calibrate, ChosenCommand& chosen);
void add_calibrate_object(CLI::App& calibrate, ChosenCommand& chosen);
void add_calibrate_stereo(CLI::App& calibrate, ChosenCommand& chosen);
void add_calibrate_time(CLI::App& calibrate, ChosenCommand& chosen);

}  // namespace tankrig::app
