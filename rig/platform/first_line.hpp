// The first line of a kernel file.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

namespace tankrig {

/// From a file of /proc or /sys; empty if it does not exist.
inline std::string first_line(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

}  // namespace tankrig
