#include "core/ray_meeting.hpp"

#include <Eigen/QR>

namespace tankrig {

Vector3d meeting(const Vector3d& a, const Vector3d& u, const Vector3d& b, const Vector3d& v) {
  Eigen::Matrix<double, 3, 2> directions;
  directions << u, -v;
  const Vector2d lengths = directions.colPivHouseholderQr().solve(b - a);
  return 0.5 * (a + lengths[0] * u + b + lengths[1] * v);
}

}  // namespace tankrig
