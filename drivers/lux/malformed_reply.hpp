// A reply that a lux meter cannot have sent.
#pragma once

#include "core/clock.hpp"
#include "core/result.hpp"

namespace tankrig {

/// `what` is a string literal.
inline Error malformed_reply(const char* what) noexcept {
  return {ErrorCode::kProtocol, 0, MonotonicClock{}.now(), what};
}

}  // namespace tankrig
