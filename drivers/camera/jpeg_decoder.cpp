#include "drivers/camera/jpeg_decoder.hpp"

#include <jerror.h>
#include <jpeglib.h>

#include <csetjmp>
#include <cstddef>
#include <cstdio>

namespace tankrig {
namespace {

struct SilentErrors {
  jpeg_error_mgr manager;
  std::jmp_buf give_up;
  bool damaged;
};

SilentErrors& errors_of(j_common_ptr decoder) { return *reinterpret_cast<SilentErrors*>(decoder->err); }

[[noreturn]] void on_error(j_common_ptr decoder) { std::longjmp(errors_of(decoder).give_up, 1); }

void on_message(j_common_ptr decoder, int level) {
  SilentErrors& errors = errors_of(decoder);
  if (level < 0 && errors.manager.msg_code != JWRN_EXTRANEOUS_DATA) errors.damaged = true;
}

/// True if all rows of a sound picture are in `out`. Nothing in here has a destructor: longjmp may leave it.
bool decode(jpeg_decompress_struct& decoder, SilentErrors& errors, const std::uint8_t* bytes, std::size_t size,
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
  SilentErrors errors{};
  jpeg_decompress_struct decoder{};
  decoder.err = jpeg_std_error(&errors.manager);
  errors.manager.error_exit = on_error;
  errors.manager.emit_message = on_message;
  const bool sound = decode(decoder, errors, bytes.data(), bytes.size(), out);
  jpeg_destroy_decompress(&decoder);
  if (!sound) return kDamaged;
  return out;
}

}  // namespace tankrig
