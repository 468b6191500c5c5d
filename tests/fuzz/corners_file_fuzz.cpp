// Clicked corners.
#include "calibration/object_pose/corners_file.hpp"
#include "core/input_error.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fuzzing::ScratchFolder folder;
  const auto file = folder.put("corners.yaml", bytes, size);
  return fuzzing::refused_or_parsed<InputError>([&] { (void)read_corners(file); });
}
