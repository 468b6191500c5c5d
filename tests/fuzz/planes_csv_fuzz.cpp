// Tables of laser planes that come with imported pictures.
#include "core/input_error.hpp"
#include "session/import/planes_csv.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fuzzing::ScratchFolder folder;
  const auto file = folder.put("planes.csv", bytes, size);
  return fuzzing::refused_or_parsed<InputError>([&] { (void)read_planes_csv(file); });
}
