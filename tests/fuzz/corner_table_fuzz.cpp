// Corners that another program found.
#include "calibration/boards/corner_table.hpp"
#include "core/input_error.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fuzzing::ScratchFolder folder;
  static const BoardTarget target = board_target(TargetKind::kCheckerboard, "4x3", 0.03);
  const auto file = folder.put("corners.csv", bytes, size);
  return fuzzing::refused_or_parsed<InputError>([&] { (void)read_corner_table(file, target); });
}
