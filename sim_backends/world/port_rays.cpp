#include "sim_backends/world/port_rays.hpp"

#include <cmath>

namespace tankrig::sim {
namespace {

/// Snell's law in vector form. `normal` points the way the light goes.
Vector3d refracted(const Vector3d& light, const Vector3d& normal, double from_index, double to_index) {
  const double ratio = from_index / to_index, incident = normal.dot(light);
  const double leaving = std::sqrt(1 - ratio * ratio * (1 - incident * incident));
  return ratio * light + (leaving - ratio * incident) * normal;
}

/// Where a ray meets the plane normal * x = distance.
Vector3d met(const Vector3d& origin, const Vector3d& direction, const Vector3d& normal, double distance) {
  return origin + (distance - normal.dot(origin)) / normal.dot(direction) * direction;
}

}  // namespace

PortRay through_port(const FlatPort& port, const Vector3d& direction) {
  const Vector3d inner = met(Vector3d::Zero(), direction, port.normal, port.distance);
  const Vector3d in_pane = refracted(direction, port.normal, port.air, port.glass);
  const Vector3d outer = met(inner, in_pane, port.normal, port.distance + port.thickness);
  return {outer, refracted(in_pane, port.normal, port.glass, port.water)};
}

}  // namespace tankrig::sim
