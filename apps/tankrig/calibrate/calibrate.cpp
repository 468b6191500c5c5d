// `tankrig calibrate`: what images and recorded sessions tell about the rig itself.
#include "apps/tankrig/calibrate/calibrate_commands.hpp"
#include "apps/tankrig/commands.hpp"

namespace tankrig::app {

void add_calibrate(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* calibrate = app.add_subcommand("calibrate", "Calibrate the rig from images and recorded sessions");
  calibrate->require_subcommand(1);
  calibrate->footer("Example: tankrig calibrate time sessions/there-and-back");
  for (const auto add :
       {add_calibrate_all, add_calibrate_check, add_calibrate_camera, add_calibrate_stereo, add_calibrate_hand_eye,
        add_calibrate_laser, add_calibrate_object, add_calibrate_time, add_calibrate_convert})
    add(*calibrate, chosen);
}

}  // namespace tankrig::app
