#include "core/result.hpp"

#include <fmt/core.h>

namespace tankrig {

const char* to_string(ErrorCode code) noexcept {
  switch (code) {
    case ErrorCode::kTimeout:
      return "timed out";
    case ErrorCode::kDisconnected:
      return "disconnected";
    case ErrorCode::kProtocol:
      return "protocol error";
    case ErrorCode::kOutOfRange:
      return "out of range";
    case ErrorCode::kNotReady:
      return "not ready";
    case ErrorCode::kRefused:
      return "refused";
    case ErrorCode::kIo:
      return "input/output error";
    case ErrorCode::kInternal:
      return "internal error";
    case ErrorCode::kOverCurrent:
      return "over-current";
    case ErrorCode::kSuspended:
      return "the machine was suspended";
  }
  return "unknown error";
}

std::string describe(const Error& error) {
  std::string text = fmt::format("{}: {}", error.where, to_string(error.code));
  if (error.os_errno != 0) text += fmt::format(" (errno {})", error.os_errno);
  return text;
}

}  // namespace tankrig
