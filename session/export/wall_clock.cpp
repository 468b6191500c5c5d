#include "session/export/wall_clock.hpp"

#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/utc.hpp"

namespace tankrig {

WallClock::WallClock(const Session& session, Stamp first) {
  if (session.info.clock_begin) {
    offset_ns_ = session.info.clock_begin->offset_ns();
    return;
  }
  const auto created = time_of_utc(session.info.created_utc);
  if (!created)
    throw InputError(session.path / "session.yaml", "created_utc: found '" + shown_text(session.info.created_utc) +
                                                        "', expected a time like 2026-01-31T12:00:00Z");
  offset_ns_ = static_cast<std::int64_t>(*created) * 1'000'000'000 - first.ns;
}

}  // namespace tankrig
