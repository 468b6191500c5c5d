// `tankrig arm home | jog | park | status | stop`: the arm by hand, with the checks of a scan.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace tankrig::app {

struct ArmCommandOptions {
  std::string rig = "tank-sim";  ///< name below etc/rigs, or a path to a rig.yaml
  std::string carrier;           ///< of the arm: "can" or "serial"; empty: the rig file's
  std::string joint;             ///< one of kJointNames
  double angle_deg = 0;
  std::optional<double> velocity_deg_s;  ///< of the fastest joint; nothing: the rig file's, or the dead zone's end
  std::vector<std::string> waived;       ///< "commission"
  bool relative = false, dry_run = false, yes = false, json = false;
};

int arm_status(const ArmCommandOptions& options);
int arm_jog(const ArmCommandOptions& options);
int arm_park(const ArmCommandOptions& options);
int arm_home(const ArmCommandOptions& options);
int arm_stop(const ArmCommandOptions& options);

}  // namespace tankrig::app
