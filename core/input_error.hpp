// The one exception of the offline tools: a user's file or argument is not as expected.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

namespace tankrig {

/// Message is one line: "FILE:LINE: what was found, what was expected".
/// RT: never.
class InputError : public std::runtime_error {
 public:
  explicit InputError(const std::string& message) : std::runtime_error(message) {}
  InputError(const std::filesystem::path& file, const std::string& message)
      : std::runtime_error(file.string() + ": " + message) {}
  /// `line` counts from 1.
  InputError(const std::filesystem::path& file, int line, const std::string& message)
      : std::runtime_error(file.string() + ":" + std::to_string(line) + ": " + message) {}
};

}  // namespace tankrig
