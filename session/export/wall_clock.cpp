#include "session/export/wall_clock.hpp"

#include <ctime>

#include "core/input_error.hpp"
#include "core/shown_text.hpp"

namespace tankrig {

WallClock::WallClock(const Session& session, Stamp first) : exact_(session.info.clock_begin.has_value()) {
  if (exact_) {
    offset_ns_ = session.info.clock_begin->offset_ns();
    return;
  }
  std::tm parts{};
  const std::string& text = session.info.created_utc;
  const char* end = strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &parts);
  if (!end || *end != '\0')
    throw InputError(session.path / "session.yaml",
                     "created_utc: found '" + shown_text(text) + "', expected a time like 2026-01-31T12:00:00Z");
  offset_ns_ = static_cast<std::int64_t>(timegm(&parts)) * 1'000'000'000 - first.ns;
}

}  // namespace tankrig
