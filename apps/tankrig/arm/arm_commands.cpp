#include "apps/tankrig/arm/arm_commands.hpp"

#include "apps/tankrig/command_line/commissioned.hpp"
#include "apps/tankrig/commands.hpp"
#include "core/arm_model.hpp"

namespace tankrig::app {
namespace {

struct ArmCommand {
  CLI::App* app;
  ArmCommandOptions& options;
};

ArmCommand add_one(CLI::App* arm, ChosenCommand& chosen, const char* name, const char* what,
                   int (*run)(const ArmCommandOptions&)) {
  CLI::App* c = arm->add_subcommand(name, what);
  ArmCommandOptions& o = options_of(c, chosen, run);
  add_rig_option(c, o.rig);
  add_carrier_option(c, o.carrier);
  add_json_flag(c, o.json);
  return {c, o};
}

void add_motion_options(const ArmCommand& c) {
  c.app
      ->add_option("--velocity", c.options.velocity_deg_s,
                   "Velocity of the fastest joint [deg/s] (default: scan.move.velocity_rad_s of the rig file)")
      ->check(CLI::PositiveNumber);
  c.app->add_flag("--dry-run", c.options.dry_run, "Check limits, speeds and clearance, but move nothing");
  c.app->add_flag("--yes", c.options.yes, "With devices: do not ask before anything moves");
  add_waive_option(c.app, c.options.waived);
}

}  // namespace

void add_arm(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* arm = app.add_subcommand("arm", "Show the arm's state, or move it with the laser off");
  arm->require_subcommand(1);
  arm->footer("Example: tankrig arm status --rig tank-sim");

  const ArmCommand status =
      add_one(arm, chosen, "status", "Print joint angles, encoders, current, homing state and connection statistics",
              arm_status);
  status.app->footer("Example: tankrig arm status --rig tank-sim --json");

  const ArmCommand stop = add_one(
      arm, chosen, "stop", "Switch the laser off, bring the arm to rest, and say whether both are confirmed", arm_stop);
  stop.app->footer("Example: tankrig arm stop --rig tank-sim");

  const ArmCommand jog = add_one(
      arm, chosen, "jog", "Move one joint to an angle, or by an angle; with devices, while a key is held", arm_jog);
  jog.app->footer("Example: tankrig arm jog --rig tank-sim elbow -5 --relative");
  jog.app->add_option("joint", jog.options.joint, "Joint to move")
      ->required()
      ->check(CLI::IsMember(std::vector<std::string>(kJointNames.begin(), kJointNames.end())));
  jog.app->add_option("angle_deg", jog.options.angle_deg, "Target angle [deg]; with --relative, the change")
      ->required();
  jog.app->add_flag("--relative", jog.options.relative, "Count the angle from where the joint is");
  add_motion_options(jog);

  const ArmCommand park = add_one(arm, chosen, "park", "Move all joints to the rig file's park posture", arm_park);
  park.app->footer("Example: tankrig arm park --rig tank-sim");
  add_motion_options(park);

  const ArmCommand home = add_one(
      arm, chosen, "home", "Find the encoders' zeros: drive the joints into their stops, one after another", arm_home);
  home.app->footer("Example: tankrig arm home --rig tank-sim --yes");
  home.app->add_flag("--yes", home.options.yes, "With devices: do not ask whether the way to the stops is clear");
}

}  // namespace tankrig::app
