// The commands of tankrig, in the order of its help.
#include "apps/tankrig/commands.hpp"

namespace tankrig::app {

void add_commands(CLI::App& app, ChosenCommand& chosen) {
  for (const auto add : {add_scan, add_bench, add_experiment, add_reconstruct, add_evaluate, add_cloud, add_session,
                         add_report, add_doctor, add_init, add_arm, add_camera, add_emulate, add_serve, add_guardian,
                         add_calibrate, add_budget, add_completion, add_manual})
    add(app, chosen);
}

}  // namespace tankrig::app
