// The arm's zero file: read at every start, by hand at worst.
#include "core/input_error.hpp"
#include "drivers/arm/arm_zero.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fuzzing::ScratchFolder folder;
  const auto file = folder.put("zero.yaml", bytes, size);
  return fuzzing::refused_or_parsed<InputError>([&] {
    ArmZero zero = load_arm_zero(file);
    zero.taken = "2017-05-03T09:12:44Z";
    if (zero.exit) zero.exit->at = zero.taken;
    if (!zero.voided.empty()) zero.voided = "an encoder lost its reference";
    save_arm_zero(file, zero);
    if (load_arm_zero(file) != zero) std::abort();
  });
}
