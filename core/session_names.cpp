#include "core/session_names.hpp"

#include <algorithm>
#include <string>

namespace tankrig {
namespace {

bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }

}  // namespace

bool is_file_name(std::string_view name) {
  return !name.empty() && name != "." && name != ".." && name.find('/') == name.npos &&
         std::none_of(name.begin(), name.end(), is_control);
}

bool is_camera_name(std::string_view name) {
  return is_file_name(name) && name.front() != '.' && name.find_first_of("\\,\" ") == name.npos;
}

bool is_picture_name(std::string_view file, std::string_view camera) {
  const std::string folder = "frames/" + std::string(camera) + "/";
  if (!file.starts_with(folder)) return false;
  for (std::size_t begin = folder.size(); begin <= file.size();) {
    const std::size_t end = std::min(file.find('/', begin), file.size());
    const std::string_view part = file.substr(begin, end - begin);
    if (!is_file_name(part)) return false;
    begin = end + 1;
  }
  return true;
}

}  // namespace tankrig
