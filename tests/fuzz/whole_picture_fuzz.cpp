// Pictures as `session check` judges them without decoding: a whole PNG has no byte to spare.
#include <cstdlib>

#include "rig/session/jpeg_file.hpp"
#include "rig/session/png_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(bytes), size);
  if (is_whole_png(text) && (is_whole_jpeg(text) || is_whole_png(text.substr(0, size - 1)))) std::abort();
  return 0;
}
