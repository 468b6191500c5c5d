// Calibration files: what was read is written and read again as the same text.
#include "core/calibration_file.hpp"
#include "core/input_error.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(bytes), size);
  return fuzzing::refused_or_parsed<InputError>([&] {
    const std::string once = calibration_text(parse_calibration(text, "calibration.yaml"));
    const std::string again = calibration_text(parse_calibration(once, "calibration.yaml"));
    if (calibration_text(parse_calibration(again, "calibration.yaml")) != again) __builtin_trap();
  });
}
