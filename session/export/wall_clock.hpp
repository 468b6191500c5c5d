// A session's stamps as wall time, for other programs.
#pragma once

#include "session/reading/session.hpp"

namespace tankrig {

/// From the clocks read when the session began. Older sessions and imports have none: then `first` counts as
/// created_utc, a whole second.
/// Units: nanoseconds since 1970 UTC.
class WallClock {
 public:
  /// Errors: InputError if created_utc is not a time.
  WallClock(const Session& session, Stamp first);

  std::int64_t at(Stamp stamp) const noexcept { return stamp.ns + offset_ns_; }

 private:
  std::int64_t offset_ns_ = 0;
};

}  // namespace tankrig
