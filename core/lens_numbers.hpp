// The numbers of a lens, in the order in which files and solvers have them.
#pragma once

#include <array>

#include "core/camera_model.hpp"

namespace tankrig {

inline constexpr std::array<double CameraModel::*, 9> kLensNumbers{
    &CameraModel::fx, &CameraModel::fy, &CameraModel::cx, &CameraModel::cy, &CameraModel::k1,
    &CameraModel::k2, &CameraModel::p1, &CameraModel::p2, &CameraModel::k3};

}  // namespace tankrig
