// What a camera's calibration looks like: where corners were seen, how they miss, and how well a pixel is known.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>

#include "calibration/intrinsics/projection_uncertainty.hpp"

namespace tankrig::app {

cv::Mat coverage_picture(const IntrinsicsSolution& solution);
/// The corners' errors, a hundred and more times enlarged.
cv::Mat residual_picture(const IntrinsicsSolution& solution);
/// At `distance` [m].
cv::Mat uncertainty_picture(const IntrinsicsSolution& solution, double distance);

/// coverage.png, residuals.png and uncertainty.png.
/// Errors: InputError naming the file.
void write_camera_pictures(const std::filesystem::path& folder, const IntrinsicsSolution& solution, double distance);

}  // namespace tankrig::app
