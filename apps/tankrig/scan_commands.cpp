// The commands of tankrig_scan_program: from the devices to the scores, and the two that a scan starts itself. ./run
// builds it where no other command is asked for, because the others take longer to compile.
#include "apps/tankrig/commands.hpp"

namespace tankrig::app {

void add_commands(CLI::App& app, ChosenCommand& chosen) {
  for (const auto add :
       {add_scan, add_reconstruct, add_evaluate, add_session, add_arm, add_camera, add_emulate, add_guardian})
    add(app, chosen);
}

}  // namespace tankrig::app
