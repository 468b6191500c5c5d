// The module tankrig_codecs.so: OpenCV's picture codecs. They bring GDAL, and with it two hundred libraries.
#include <opencv2/imgcodecs.hpp>

#include "core/picture_codecs.hpp"

namespace {

cv::Mat decode(std::string_view bytes, int flags) {
  try {
    return cv::imdecode(cv::Mat(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data())), flags);
  } catch (const cv::Exception&) {
    return {};
  }
}

}  // namespace

extern "C" {
extern const tankrig::PictureCodecs tankrig_codecs;
const tankrig::PictureCodecs tankrig_codecs{decode};
}
