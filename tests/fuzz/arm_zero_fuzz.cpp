// The arm's zero file: read at every start, by hand at worst.
#include "core/input_error.hpp"
#include "drivers/arm/arm_zero.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fuzzing::ScratchFolder folder;
  const auto file = folder.put("zero.yaml", bytes, size);
  return fuzzing::refused_or_parsed<InputError>([&] {
    const ArmZero zero = load_arm_zero(file);
    save_arm_zero(file, {zero.raw, "2017-05-03T09:12:44Z"});
    if (load_arm_zero(file).raw != zero.raw) std::abort();
  });
}
