#include "calibration/visp/module/visp_conversion.hpp"

#include <Eigen/SVD>
#include <string>

#include "core/input_error.hpp"

namespace tankrig {

vpHomogeneousMatrix to_visp(const Transform& aMb) {
  vpHomogeneousMatrix out;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      out[static_cast<unsigned>(row)][static_cast<unsigned>(column)] = aMb(row, column);
  return out;
}

Transform from_visp(const vpHomogeneousMatrix& aMb) {
  Eigen::Matrix3d given;
  Vector3d translation;
  for (int row = 0; row < 3; ++row) {
    const double* line = aMb[static_cast<unsigned>(row)];
    given.row(row) << line[0], line[1], line[2];
    translation[row] = line[3];
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(given, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
  const double off = (given - rotation).norm();
  if (!(off < 1e-3) || rotation.determinant() < 0)
    throw InputError("ViSP's matrix is " + std::to_string(off) + " from a rotation, expected one within 0.001");
  Transform out = Transform::Identity();
  out.linear() = rotation;
  out.translation() = translation;
  return out;
}

}  // namespace tankrig
