// What `calibrate laser` measures a sheet from; without an arm: pictures of a scanner that carries camera and laser.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/tankrig/command_line/progress.hpp"
#include "calibration/laser_plane/checkerboard.hpp"
#include "calibration/laser_plane/laser_plane.hpp"

namespace tankrig::app {

struct LaserData {
  LaserPlaneProblem problem;          ///< in c, on an arm in e
  std::vector<std::string> left_out;  ///< pictures that have no part in it, and why
  double board_rms = 0;               ///< reprojection of the boards' corners [px]
};

/// Pictures that show board and stripe together, laser and camera rigid with each other.
/// Errors: InputError, also if no picture shows both.
LaserData laser_data_of_pictures(const std::vector<std::filesystem::path>& pictures, const CameraModel& camera,
                                 const Checkerboard& board, Progress& progress);

}  // namespace tankrig::app
