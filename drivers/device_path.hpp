// Where a rig file's device lies: an absolute path, or one in the runtime folder that emulated devices share.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace tankrig {

/// "runtime/NAME" is NAME in `runtime`; anything else stays as it is.
inline std::string device_path(const std::string& text, const std::filesystem::path& runtime) {
  constexpr std::string_view kPrefix = "runtime/";
  return text.starts_with(kPrefix) ? (runtime / text.substr(kPrefix.size())).string() : text;
}

}  // namespace tankrig
