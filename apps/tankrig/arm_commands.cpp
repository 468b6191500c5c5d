#include "apps/tankrig/arm_commands.hpp"

#include "core/arm_model.hpp"

namespace tankrig::app {
namespace {

CLI::App* add_one(CLI::App* arm, const char* name, const char* what, ArmCommandOptions& o,
                  int (*run)(const ArmCommandOptions&)) {
  CLI::App* c = arm->add_subcommand(name, what);
  c->add_option("--rig", o.rig, "Rig name below etc/rigs, or a rig.yaml")->capture_default_str();
  c->add_option("--carrier", o.carrier, "The arm's wire on a rig with devices (default: the rig file's)")
      ->check(CLI::IsMember({"can", "serial"}));
  c->add_flag("--json", o.json, "Print one JSON object on standard output");
  c->callback([&o, run] { o.run = run; });
  return c;
}

void add_motion_options(CLI::App* c, ArmCommandOptions& o) {
  c->add_option("--velocity", o.velocity_deg_s,
                "Velocity of the fastest joint [deg/s] (default: the rig file's scan: move: velocity_rad_s)")
      ->check(CLI::PositiveNumber);
  c->add_flag("--dry-run", o.dry_run, "Check limits, speeds and clearance; move nothing");
}

}  // namespace

void add_arm(CLI::App& app, ArmCommandOptions& o) {
  CLI::App* arm = app.add_subcommand("arm", "Move the arm by hand, laser off, and look at its state");
  arm->require_subcommand(1);
  arm->footer("Example: tankrig arm status --rig tank-sim");

  CLI::App* c =
      add_one(arm, "status", "Print joints, encoders, current, homing, and the carrier's counts", o, arm_status);
  c->footer("Example: tankrig arm status --rig tank-sim --json");

  c = add_one(arm, "jog", "Move one joint to an angle, or by an angle", o, arm_jog);
  c->footer("Example: tankrig arm jog --rig tank-sim elbow -5 --relative");
  c->add_option("joint", o.joint, "Joint: slew, shoulder, elbow, jaw_rotate, jaw_opening")
      ->required()
      ->check(CLI::IsMember(std::vector<std::string>(kJointNames.begin(), kJointNames.end())));
  c->add_option("angle_deg", o.angle_deg, "Where to [deg]; with --relative, how far")->required();
  c->add_flag("--relative", o.relative, "The angle counts from where the joint is");
  add_motion_options(c, o);

  c = add_one(arm, "park", "Move all joints to the rig file's park posture", o, arm_park);
  c->footer("Example: tankrig arm park --rig tank-sim");
  add_motion_options(c, o);

  c = add_one(arm, "home", "Find the zero of the encoders: every joint moves into its stop", o, arm_home);
  c->footer("Example: tankrig arm home --rig tank-sim --yes");
  c->add_flag("--yes", o.yes, "Do not ask: the arm is free to move into its stops");
}

}  // namespace tankrig::app
