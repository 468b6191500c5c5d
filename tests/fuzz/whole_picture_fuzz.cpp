// Pictures as they are judged without decoding: a whole PNG has no byte to spare, and a size has two sides.
#include <cstdlib>

#include "session/reading/picture_file.hpp"
#include "session/recording/png_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(bytes), size);
  if (is_whole_png(text) && (is_whole_jpeg(text) || is_whole_png(text.substr(0, size - 1)))) std::abort();
  if (const auto seen = picture_size(text); seen && (seen->width < 1 || seen->height < 1)) std::abort();
  return 0;
}
