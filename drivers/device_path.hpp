// The path of a rig file's device: absolute, or in the runtime folder of emulated devices.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace tankrig {

/// "runtime/NAME" is NAME in `runtime`; other paths stay.
inline std::string device_path(const std::string& text, const std::filesystem::path& runtime) {
  constexpr std::string_view kPrefix = "runtime/";
  return text.starts_with(kPrefix) ? (runtime / text.substr(kPrefix.size())).string() : text;
}

}  // namespace tankrig
