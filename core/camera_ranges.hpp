// The ranges of a calibrated camera, the same for every reader.
#pragma once

#include "core/config_node.hpp"

namespace tankrig {

inline constexpr ConfigRange kFocalRange{1e-9, 1e5};           ///< fx, fy [px]
inline constexpr ConfigRange kPrincipalPointRange{-1e4, 1e5};  ///< cx, cy [px]
inline constexpr ConfigRange kRadialRange{-100, 100};          ///< k1, k2, k3
inline constexpr ConfigRange kTangentialRange{-10, 10};        ///< p1, p2

/// Message for a camera that is not CameraModel::invertible().
inline constexpr const char* kFoldsOver = "distortion folds over within the image, expected one ray for every pixel";

}  // namespace tankrig
