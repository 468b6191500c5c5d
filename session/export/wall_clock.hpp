// A session's stamps as wall time: for other programs, which know no other.
#pragma once

#include "session/reading/session.hpp"

namespace tankrig {

/// By the clocks read at the session's beginning; without them (older sessions, imports) `first` is taken for
/// created_utc, a whole second.
/// Units: nanoseconds since 1970 UTC.
class WallClock {
 public:
  /// Errors: InputError if created_utc is no time.
  WallClock(const Session& session, Stamp first);

  std::int64_t at(Stamp stamp) const noexcept { return stamp.ns + offset_ns_; }
  /// Read from clocks, not taken from created_utc.
  bool exact() const noexcept { return exact_; }

 private:
  std::int64_t offset_ns_ = 0;
  bool exact_ = false;
};

}  // namespace tankrig
