// Looks at the whole plan before anything moves: joint limits, actuator speed, and room to box, floor and walls.
#pragma once

#include <string>
#include <vector>

#include "rig/plan/scan_plan.hpp"

namespace tankrig {

/// A box anywhere in the arm base's frame.
struct ObstacleBox {
  std::string name;
  Transform bMx = Transform::Identity();  ///< centre of the box, axes along its sides
  Vector3d half_size = Vector3d::Zero();  ///< [m]
};

/// A segment with a radius [m].
struct Capsule {
  Vector3d a = Vector3d::Zero(), b = Vector3d::Zero();
  double radius = 0;
};

/// What the arm must not touch, and how thick the arm is.
/// Units: metres.
struct Obstacles {
  Vector3d tank_size{2.0, 2.0, 1.5};  ///< inner x, y of the walls and their height; the floor's centre is w's origin
  Transform wMb = Transform::Identity();
  std::vector<ObstacleBox> boxes;
  double link_radius = 0.045;    ///< of every link, b to e
  double tool_length = 0;        ///< how far the tool reaches beyond e along its z
  std::vector<Capsule> carried;  ///< bodies rigid with e: the laser projector
  double margin = 0.02;          ///< smallest clearance that is not refused
};

/// What a joint may do beyond its limits in the arm model.
struct MotionLimits {
  double angle_margin = 0.05;     ///< kept from every joint limit: the laboratory's [rad]
  double stop_margin = 0.02;      ///< how far beyond a limit a joint may stand at its stop when the plan begins [rad]
  double max_velocity = 1.0;      ///< any joint [rad/s]
  double max_ticks_per_s = 2000;  ///< any actuator; the laboratory's RPM_LIMIT
};

struct MotionCheck {
  double min_clearance = 0;  ///< of the arm's skin to the nearest obstacle, over the whole plan [m]
  std::string nearest;       ///< obstacle and link: "box: forearm"
  std::string where;         ///< name of the segment
  double when = 0;           ///< plan time [s]
};

/// Samples the plan so closely that no point of the arm moves more than 5 mm between two samples.
/// Errors: InputError naming joint, value and limit, or what is hit, the segment, its time and the clearance.
MotionCheck check_motion(const ScanPlan& plan, const ArmModel& arm, const Obstacles& obstacles,
                         const MotionLimits& limits = {});

/// Distance of the segment a-b from the box, 0 if they meet.
double distance(const Vector3d& a, const Vector3d& b, const ObstacleBox& box);

}  // namespace tankrig
