// Hand-eye views in a table.
#include "calibration/hand_eye/hand_eye_file.hpp"
#include "core/input_error.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fuzzing::ScratchFolder folder;
  constexpr char kYaml[] = "views_csv: views.csv\n";
  const auto file = folder.put("hand_eye.yaml", reinterpret_cast<const std::uint8_t*>(kYaml), sizeof kYaml - 1);
  folder.put("views.csv", bytes, size);
  return fuzzing::refused_or_parsed<InputError>([&] { (void)read_hand_eye_folder(file); });
}
