// Hand-eye data folders: hand_eye.yaml, with its views in it.
#include "calibration/hand_eye/hand_eye_file.hpp"
#include "core/input_error.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fuzzing::ScratchFolder folder;
  const auto file = folder.put("hand_eye.yaml", bytes, size);
  return fuzzing::refused_or_parsed<InputError>([&] { (void)read_hand_eye_folder(file); });
}
