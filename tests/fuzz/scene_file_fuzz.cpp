// Scene files.
#include "core/input_error.hpp"
#include "sim_backends/world/scene.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fuzzing::ScratchFolder folder;
  folder.put("box.obj", nullptr, 0);
  const auto file = folder.put("scene.xml", bytes, size);
  return fuzzing::refused_or_parsed<InputError>([&] { (void)sim::read_scene(file); });
}
