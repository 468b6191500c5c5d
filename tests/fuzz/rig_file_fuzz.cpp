// Rig files.
#include "core/input_error.hpp"
#include "rig/config/rig_config.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fuzzing::ScratchFolder folder;
  folder.put("box.obj", nullptr, 0);
  const auto file = folder.put("rig.yaml", bytes, size);
  return fuzzing::refused_or_parsed<InputError>([&] { (void)load_rig(file); });
}
