// Logs of candump's format: what is read is written back the same.
#include <cstdlib>
#include <string_view>

#include "core/input_error.hpp"
#include "drivers/can/can_log.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(bytes), size);
  return fuzzing::refused_or_parsed<InputError>([&] {
    for (const CanLogEntry& entry : parse_can_log(text).entries) {
      std::string line;
      append_line(entry, line);
      if (!(parse_can_log_line(line) == entry)) std::abort();
    }
  });
}
