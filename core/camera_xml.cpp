#include "core/camera_xml.hpp"

#include <algorithm>
#include <string_view>

#include "core/input_error.hpp"

namespace tankrig {

CameraXml::CameraXml(std::string text, const std::filesystem::path& file) : text_(std::move(text)) {
  if (const auto zero = text_.find('\0'); zero != std::string::npos)
    throw InputError(file, line(zero), "found a byte 0, expected a camera calibration in XML");
  const auto parsed = document_.load_buffer(text_.data(), text_.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!parsed)
    throw InputError(file, line(static_cast<std::size_t>(parsed.offset)),
                     std::string("found XML that does not parse (") + parsed.description() +
                         "), expected a camera calibration in OpenCV's XML or ViSP's");
}

bool CameraXml::is_xml(const std::string& text) {
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  const std::size_t begin = text.find_first_not_of(" \t\r\n", text.starts_with(kByteOrderMark) ? 3 : 0);
  return begin != text.npos && text[begin] == '<';
}

int CameraXml::line(std::size_t offset) const {
  const auto end = text_.begin() + static_cast<std::ptrdiff_t>(std::min(offset, text_.size()));
  return 1 + static_cast<int>(std::count(text_.begin(), end, '\n'));
}

}  // namespace tankrig
