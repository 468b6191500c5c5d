// The record of a start-up test: what could be read can be written, and read again to the same.
#include <cstdlib>

#include "core/input_error.hpp"
#include "rig/commission/commission_record.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fuzzing::ScratchFolder folder;
  return fuzzing::refused_or_parsed<InputError>([&] {
    const CommissionRecord first = read_commission(folder.put("record.yaml", bytes, size));
    const std::string text = commission_text(first);
    const auto again = folder.put("again.yaml", reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
    try {
      if (commission_text(read_commission(again)) != text) std::abort();
    } catch (const InputError&) {
      std::abort();
    }
  });
}
