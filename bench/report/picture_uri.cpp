#include "bench/report/picture_uri.hpp"

#include <openssl/evp.h>

#include "core/input_error.hpp"
#include "core/regular_file.hpp"

namespace tankrig {

std::string picture_uri(const std::filesystem::path& file) {
  const std::string bytes = read_regular_file(file, kMostPictureBytes, "a PNG or JPEG picture");
  const char* kind = bytes.starts_with("\x89PNG") ? "png" : bytes.starts_with("\xff\xd8") ? "jpeg" : nullptr;
  if (!kind) throw InputError(file, "cannot be read, expected a PNG or JPEG picture");
  std::string base64((bytes.size() + 2) / 3 * 4 + 1, '\0');
  base64.resize(static_cast<std::size_t>(EVP_EncodeBlock(reinterpret_cast<unsigned char*>(base64.data()),
                                                         reinterpret_cast<const unsigned char*>(bytes.data()),
                                                         static_cast<int>(bytes.size()))));
  return std::string("data:image/") + kind + ";base64," + base64;
}

}  // namespace tankrig
