// Camera files: the field's OpenCV (YAML, XML), ROS camera_info, Kalibr camchain, mrcal .cameramodel, ViSP XML; and our own.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/camera_model.hpp"
#include "core/enum_names.hpp"

namespace tankrig {

/// kTankrig: a name, and a model as in a rig file; the only one that holds a flat port.
enum class CameraFileFormat { kRos, kOpenCv, kOpenCvXml, kKalibr, kMrcal, kVisp, kTankrig };
template <>
inline constexpr std::array kNames<CameraFileFormat>{"ros",   "opencv", "opencv-xml", "kalibr",
                                                     "mrcal", "visp",   "tankrig"};

/// How an image is rotated and projected to be rectified, as in ROS's camera_info: a camera-frame point p appears at
/// the rectified pixel P * (R p, 1).
/// Units: pixels; the last column of P is metres times pixels.
struct Rectification {
  cv::Matx33d R = cv::Matx33d::eye();
  cv::Matx34d P = cv::Matx34d::zeros();
};

/// A camera as a file has it.
struct FileCamera {
  std::string name;
  CameraModel model;
  std::optional<Transform> cMr;  ///< the file's reference in the camera, in a camchain and in mrcal's files
  std::optional<Rectification> rectification;  ///< in ROS's files
};

/// The cameras of a file, at least one; its content tells the format.
/// Errors: InputError with file, field and what was expected.
std::vector<FileCamera> read_camera_file_whole(const std::filesystem::path& file);

/// The camera of a file that has one.
/// Errors: as above; also of a file with several cameras, naming them.
CameraModel read_camera_file(const std::filesystem::path& file);

/// What a camera has that `format` has no place for, in words: "k2 = 0.07"; empty if the file will hold all of the model.
std::string lacking_in(CameraFileFormat format, const CameraModel& camera);

/// read_camera_file_whole() reads the numbers back exactly.
/// Errors: InputError naming the file; also if `cameras` are several and the format holds one, or a model does not fit.
void write_camera_file(const std::filesystem::path& file, CameraFileFormat format,
                       const std::vector<FileCamera>& cameras);

/// For a single camera: distortion removed, no rotation.
Rectification rectification_of(const CameraModel& camera);

/// ROS camera_info.
void write_camera_file(const std::filesystem::path& file, const CameraModel& camera, const std::string& name);
void write_camera_file(const std::filesystem::path& file, const CameraModel& camera, const std::string& name,
                       const Rectification& rectification);

/// What a folder for other programs holds of a camera: NAME.yaml for ROS, NAME.opencv.yml for OpenCV. Of a camera behind a
/// port NAME.yaml alone, in the format tankrig: read as a pinhole it would be wrong by a third.
void write_camera_files(const std::filesystem::path& folder, const CameraModel& camera, const std::string& name);

/// For OpenCV's cv::FileStorage, which requires a first line that other YAML readers refuse.
void write_opencv_camera_file(const std::filesystem::path& file, const CameraModel& camera, const std::string& name);

}  // namespace tankrig
