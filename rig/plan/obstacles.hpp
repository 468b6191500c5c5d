// What stands in the arm's way, and how thick the arm is.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "core/frames.hpp"

namespace tankrig {

/// A segment with a radius [m].
struct Capsule {
  Vector3d a = Vector3d::Zero(), b = Vector3d::Zero();
  double radius = 0;
};

/// Solid, anywhere in a frame x.
struct Box {
  Transform xMbox = Transform::Identity();  ///< centre of the box, axes along its sides
  Vector3d size = Vector3d::Zero();         ///< [m]
};

using Shape = std::variant<Box, Capsule>;

/// A body rigid with b or e.
template <class S>
struct Named {
  std::string name;
  S shape;
};

/// A surface of triangles; its inside counts as free.
struct Surface {
  std::vector<Vector3d> vertices;
  std::vector<Eigen::Vector3i> triangles;
};

/// What the arm must not touch, and how thick it is.
/// Frames: b; carried bodies e.
/// Units: metres.
struct Obstacles {
  Vector3d tank_size{2.0, 2.0, 1.5};  ///< inner x, y of the walls and their height; the floor's centre is w's origin
  Transform wMb = Transform::Identity();
  double margin = 0.02;                                 ///< smallest clearance that is not refused
  double link_radius = 0.045;                           ///< of every link, b to e
  double tool_length = 0;                               ///< how far the tool reaches beyond e along its z
  Capsule base{{0, 0, -0.13}, Vector3d::Zero(), 0.06};  ///< flange to slew axis: 0.13 m is the public robot
                                                        ///< description's, the radius an assumption
  std::vector<Named<Shape>> carried;                    ///< rigid with e: the laser projector
  std::vector<Named<Shape>> fixed;                      ///< the frame that holds arm and cameras, and what else stands
  std::vector<Named<Box>> cameras;
  Surface object;
};

}  // namespace tankrig
