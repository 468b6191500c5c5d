// session.yaml: what could be read can be written, and read again.
#include <cstdlib>

#include "core/input_error.hpp"
#include "rig/session/session_yaml.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fuzzing::ScratchFolder folder;
  return fuzzing::refused_or_parsed<InputError>([&] {
    const std::string text = session_yaml(read_session_yaml(folder.put("session.yaml", bytes, size)));
    const auto again = folder.put("again.yaml", reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
    try {
      if (session_yaml(read_session_yaml(again)).size() < text.size() / 2) std::abort();
    } catch (const InputError&) {
      std::abort();
    }
  });
}
