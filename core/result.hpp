// Failure as a value. No news is std::optional; a failure is Result<T>.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>

#include "core/time.hpp"

namespace tankrig {

enum class ErrorCode : std::uint8_t {
  kTimeout,
  kDisconnected,
  kProtocol,
  kOutOfRange,
  kNotReady,
  kRefused,
  kIo,
  kInternal,
  kOverCurrent,
  kSuspended,
};

const char* to_string(ErrorCode code) noexcept;

/// What went wrong on a device or in the cycle: trivially copyable, made without allocation.
/// RT: safe.
struct Error {
  ErrorCode code = ErrorCode::kInternal;
  int os_errno = 0;  ///< errno of the failed call, 0 if none
  Stamp when{};
  const char* where = "";  ///< string literal: device and action, e.g. "arm: read joints"
};

/// "arm: read joints: timeout (errno 5)".
/// RT: never.
std::string describe(const Error& error);

/// A T or an Error.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}  // NOLINT(google-explicit-constructor)
  Result(Error error) : state_(std::in_place_index<1>, error) {}         // NOLINT(google-explicit-constructor)

  bool ok() const noexcept { return state_.index() == 0; }
  explicit operator bool() const noexcept { return ok(); }
  T& value() { return std::get<0>(state_); }
  const T& value() const { return std::get<0>(state_); }
  const Error& error() const { return std::get<1>(state_); }

 private:
  std::variant<T, Error> state_;
};

/// Success or an Error.
template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(error), ok_(false) {}  // NOLINT(google-explicit-constructor)

  bool ok() const noexcept { return ok_; }
  explicit operator bool() const noexcept { return ok_; }
  const Error& error() const noexcept { return error_; }

 private:
  Error error_{};
  bool ok_ = true;
};

using Status = Result<void>;

}  // namespace tankrig
