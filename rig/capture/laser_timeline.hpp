// When the laser really shone, as far as the cycle has reported: for tagging frames.
#pragma once

#include <deque>
#include <limits>

#include "rig/executive/cycle_record.hpp"

namespace tankrig {

/// Threads: one.
/// RT: never.
class LaserTimeline {
 public:
  enum class Light { kOff, kOn, kMixed, kNotYetKnown };

  /// Records in order of their stamps. One without a laser reading says nothing.
  void add(const CycleRecord& record) {
    if (record.laser) add(record.stamp, *record.laser);
  }

  /// What the laser reported at `now`.
  void add(Stamp now, const LaserState& laser) {
    if (edges_.empty() || edges_.back().emitting != laser.emitting)
      edges_.push_back(
          {edges_.empty() ? Stamp{std::numeric_limits<std::int64_t>::min()} : laser.since, laser.emitting});
    if (edges_.size() > kEdges) edges_.pop_front();
    known_until_ = now;
  }

  /// What the laser did in all of [begin, end].
  Light during(Stamp begin, Stamp end) const {
    if (edges_.empty() || end > known_until_) return Light::kNotYetKnown;
    auto edge = edges_.rbegin();
    while (edge != edges_.rend() && edge->since > end) ++edge;
    if (edge == edges_.rend() || edge->since > begin) return Light::kMixed;
    return edge->emitting ? Light::kOn : Light::kOff;
  }

 private:
  static constexpr std::size_t kEdges = 256;
  struct Edge {
    Stamp since;
    bool emitting;
  };
  std::deque<Edge> edges_;
  Stamp known_until_{std::numeric_limits<std::int64_t>::min()};
};

}  // namespace tankrig
