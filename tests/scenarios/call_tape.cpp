#include "tests/scenarios/call_tape.hpp"

#include <algorithm>

namespace tankrig::scenarios {

std::optional<Reaction> reaction(const std::vector<TapeEntry>& tape, Stamp from, std::optional<Stamp> noticed) {
  const auto detection = std::find_if(tape.begin(), tape.end(), [&](const TapeEntry& e) {
    return e.when >= from && (e.failed || e.call == Call::kScan || (noticed && e.when >= *noticed));
  });
  if (detection == tape.end()) return std::nullopt;
  Reaction r;
  r.detected = noticed ? std::min(*noticed, detection->when) : detection->when;
  bool lit = false;  // when it was noticed
  for (auto e = tape.begin(); e != detection; ++e)
    if (e->call == Call::kLaserOn || e->call == Call::kLaserOff) lit = e->call == Call::kLaserOn && !e->failed;
  const auto next = [&](auto begin, Call call) {
    return std::find_if(begin, tape.end(), [call](const TapeEntry& e) { return e.call == call; });
  };
  const auto off = next(detection, Call::kLaserOff);
  const auto stop = next(detection, Call::kStop);
  if (stop == tape.end() || (off == tape.end() && lit)) return std::nullopt;
  const bool was_dark = off == tape.end() || (!lit && stop < off);  // nothing to switch off
  r.laser_off = was_dark ? r.detected : off->when;
  r.laser_cycles = was_dark ? 0 : off->cycle - detection->cycle;
  r.laser_first = was_dark || off < stop;
  r.arm_stop = stop->when;
  r.arm_cycles = stop->cycle - (was_dark ? detection->cycle : off->cycle);
  return r;
}

}  // namespace tankrig::scenarios
