// A session's three tables; the first byte says which.
#include <cstdlib>

#include "core/input_error.hpp"
#include "core/session_names.hpp"
#include "session/reading/session_tables.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fuzzing::ScratchFolder folder;
  if (size == 0) return 0;
  const auto file = folder.put("table.csv", bytes + 1, size - 1);
  return fuzzing::refused_or_parsed<InputError>([&] {
    switch (bytes[0]) {
      case 'j':
        (void)read_joints_csv(file);
        break;
      case 'f':
        for (const FrameRecord& frame : read_frames_csv(file).records)
          if (!is_picture_name(frame.file, frame.camera)) std::abort();
        break;
      case 'e':
        (void)read_events_csv(file, true);
        break;
      default:
        break;
    }
  });
}
