// Pictures as a camera's wire carries them; the first byte chooses format, channels and size.
#include <cstdlib>

#include "drivers/camera/pixel_format.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  RawPicture picture;
  picture.format = kPixelFormats[bytes[0] % kPixelFormats.size()];
  picture.width = 16;
  picture.height = bytes[0] >= 128 ? 8 : 16;
  picture.bytes = {bytes + 1, size - 1};
  const int channels = bytes[0] & 64 ? 1 : 3;
  const auto image = to_image(picture, channels);
  if (image.ok() && (image.value().cols != 16 || image.value().channels() != channels)) std::abort();
  return 0;
}
