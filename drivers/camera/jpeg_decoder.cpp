#include "drivers/camera/jpeg_decoder.hpp"

#include "core/jpeg_errors.hpp"

namespace tankrig {
namespace {

/// True if all rows of a sound picture are in `out`. Nothing in here has a destructor: longjmp may leave it.
bool decode(jpeg_decompress_struct& decoder, JpegErrors& errors, const std::uint8_t* bytes, std::size_t size,
            cv::Mat& out) {
  if (setjmp(errors.give_up) != 0) return false;
  jpeg_create_decompress(&decoder);
  jpeg_mem_src(&decoder, bytes, size);
  if (jpeg_read_header(&decoder, TRUE) != JPEG_HEADER_OK) return false;
  if (decoder.image_width != static_cast<JDIMENSION>(out.cols) ||
      decoder.image_height != static_cast<JDIMENSION>(out.rows) || decoder.progressive_mode)
    return false;
  decoder.out_color_space = out.channels() == 1 ? JCS_GRAYSCALE : JCS_EXT_BGR;
  decoder.dct_method = JDCT_ISLOW;
  if (!jpeg_start_decompress(&decoder)) return false;
  while (decoder.output_scanline < decoder.output_height) {
    JSAMPROW row = out.data + out.step[0] * decoder.output_scanline;
    if (jpeg_read_scanlines(&decoder, &row, 1) != 1) return false;
  }
  return jpeg_finish_decompress(&decoder) && !errors.damaged;
}

}  // namespace

Result<cv::Mat> decode_jpeg(std::span<const std::uint8_t> bytes, int width, int height, int channels) {
  constexpr Error kDamaged{ErrorCode::kProtocol, 0, {}, "picture: damaged JPEG, or one of another size"};
  if (bytes.size() < 4 || bytes[0] != 0xff || bytes[1] != 0xd8) return kDamaged;
  cv::Mat out(height, width, CV_8UC(channels));
  JpegErrors errors{};
  jpeg_decompress_struct decoder{};
  errors.attach(decoder);
  const bool sound = decode(decoder, errors, bytes.data(), bytes.size(), out);
  jpeg_destroy_decompress(&decoder);
  if (!sound) return kDamaged;
  return out;
}

}  // namespace tankrig
