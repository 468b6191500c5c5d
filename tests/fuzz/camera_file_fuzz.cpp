// Calibrations in the files of OpenCV, ROS, Kalibr, mrcal and ViSP: the content tells which.
#include "core/camera_file.hpp"
#include "core/input_error.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fuzzing::ScratchFolder folder;
  const auto file = folder.put("camera.yaml", bytes, size);
  return fuzzing::refused_or_parsed<InputError>([&] { (void)read_camera_file_whole(file); });
}
