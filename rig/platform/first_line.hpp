// What the kernel says in one line.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

namespace tankrig {

/// Of a file of /proc or /sys; empty where there is none.
inline std::string first_line(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

}  // namespace tankrig
