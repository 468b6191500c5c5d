#include "bench/report/picture_uri.hpp"

#include "bench/report/base64.hpp"
#include "core/input_error.hpp"
#include "core/regular_file.hpp"

namespace tankrig {

std::string picture_uri(const std::filesystem::path& file) {
  const std::string bytes = read_regular_file(file, kMostPictureBytes, "a PNG or JPEG picture");
  const char* kind = bytes.starts_with("\x89PNG") ? "png" : bytes.starts_with("\xff\xd8") ? "jpeg" : nullptr;
  if (!kind) throw InputError(file, "cannot be read, expected a PNG or JPEG picture");
  return std::string("data:image/") + kind + ";base64," + base64(bytes);
}

}  // namespace tankrig
