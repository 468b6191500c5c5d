// Camera files: OpenCV calibrations in YAML or XML, and ROS camera_info in YAML.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>

#include "core/camera_model.hpp"

namespace tankrig {

/// Reads an OpenCV calibration (camera_matrix, distortion_coefficients; cv::FileStorage's YAML or XML) or a ROS
/// camera_info YAML file.
/// Errors: InputError with file, field and what was expected.
CameraModel read_camera_file(const std::filesystem::path& file);

/// How an image is rotated and projected to be rectified, as in ROS's camera_info: a camera-frame point p appears at
/// the rectified pixel P * (R p, 1).
/// Units: pixels; the last column of P is metres times pixels.
struct Rectification {
  cv::Matx33d R = cv::Matx33d::eye();
  cv::Matx34d P = cv::Matx34d::zeros();
};

/// For a single camera: distortion removed, no rotation.
Rectification rectification_of(const CameraModel& camera);

/// Writes ROS camera_info YAML, which read_camera_file() reads back exactly.
/// Errors: InputError naming the file.
void write_camera_file(const std::filesystem::path& file, const CameraModel& camera, const std::string& name);
void write_camera_file(const std::filesystem::path& file, const CameraModel& camera, const std::string& name,
                       const Rectification& rectification);

/// For OpenCV's cv::FileStorage, which requires a first line that other YAML readers refuse. It and read_camera_file()
/// read the file back exactly.
/// Errors: InputError naming the file.
void write_opencv_camera_file(const std::filesystem::path& file, const CameraModel& camera, const std::string& name);

}  // namespace tankrig
