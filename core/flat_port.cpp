#include "core/flat_port.hpp"

namespace tankrig {

ViewingRay FlatPort::beyond(const Vector3d& air_direction) const {
  // Along the faces, index times direction is the same in all three.
  const double cosine = normal.dot(air_direction);
  const Vector3d across = air_direction - cosine * normal;
  const auto refracted = [&](double index) -> Vector3d {
    const Vector3d along_faces = air / index * across;
    return along_faces + std::sqrt(1 - along_faces.squaredNorm()) * normal;
  };
  const Vector3d in_glass = refracted(glass);
  return {distance / cosine * air_direction + thickness / normal.dot(in_glass) * in_glass,
          refracted(water).normalized()};
}

}  // namespace tankrig
