#include "core/picture_codecs.hpp"

#include <jpeglib.h>
#include <png.h>

#include <cstdio>
#include <cstdlib>
#include <memory>

#include "core/input_error.hpp"
#include "core/module.hpp"

namespace tankrig {
namespace {

bool is_picture(const cv::Mat& picture) {
  return !picture.empty() && picture.depth() == CV_8U && (picture.channels() == 1 || picture.channels() == 3);
}

}  // namespace

std::string picture_png(const cv::Mat& picture) {
  if (!is_picture(picture)) throw InputError("a picture cannot be written as PNG, expected 8 bits, grey or BGR");
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.cols);
  image.height = static_cast<png_uint_32>(picture.rows);
  image.format = picture.channels() == 1 ? PNG_FORMAT_GRAY : PNG_FORMAT_BGR;
  image.flags = PNG_IMAGE_FLAG_FAST;
  std::string png(PNG_IMAGE_PNG_SIZE_MAX(image), '\0');
  png_alloc_size_t size = png.size();
  if (!png_image_write_to_memory(&image, png.data(), &size, 0, picture.data, static_cast<png_int_32>(picture.step[0]),
                                 nullptr))
    throw InputError(std::string("a picture cannot be written as PNG: ") + image.message);
  png.resize(size);
  return png;
}

std::string picture_jpeg(const cv::Mat& picture, int quality) {
  if (!is_picture(picture)) throw InputError("a picture cannot be written as JPEG, expected 8 bits, grey or BGR");
  // libjpeg's own error handler ends the program. It is called where memory is short or the size is beyond JPEG's.
  if (picture.cols > JPEG_MAX_DIMENSION || picture.rows > JPEG_MAX_DIMENSION)
    throw InputError("a picture cannot be written as JPEG, expected at most 65500 pixels a side");
  jpeg_error_mgr errors;
  jpeg_compress_struct encoder{};
  encoder.err = jpeg_std_error(&errors);
  jpeg_create_compress(&encoder);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&encoder, &bytes, &size);
  encoder.image_width = static_cast<JDIMENSION>(picture.cols);
  encoder.image_height = static_cast<JDIMENSION>(picture.rows);
  encoder.input_components = picture.channels();
  encoder.in_color_space = picture.channels() == 1 ? JCS_GRAYSCALE : JCS_EXT_BGR;
  jpeg_set_defaults(&encoder);
  jpeg_set_quality(&encoder, quality, TRUE);
  jpeg_start_compress(&encoder, TRUE);
  while (encoder.next_scanline < encoder.image_height) {
    JSAMPROW row = const_cast<unsigned char*>(picture.ptr(static_cast<int>(encoder.next_scanline)));
    jpeg_write_scanlines(&encoder, &row, 1);
  }
  jpeg_finish_compress(&encoder);
  jpeg_destroy_compress(&encoder);
  const std::unique_ptr<unsigned char, decltype(&std::free)> owner(bytes, std::free);
  return {reinterpret_cast<const char*>(bytes), size};
}

cv::Mat decode_by_opencv(std::string_view bytes, int flags) {
  static const auto& codecs = *static_cast<const PictureCodecs*>(module_symbol("tankrig_codecs.so", "tankrig_codecs"));
  return codecs.decode(bytes, flags);
}

}  // namespace tankrig
