// Triggers matched with their frames: delay, losses.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "rig/capture/trigger_thread.hpp"

namespace tankrig {

/// For one camera. A frame belongs to the last trigger before its exposure began; earlier triggers without a frame are
/// lost. So a camera must begin to expose before its next trigger.
/// Threads: one.
/// RT: never.
class TriggerRecord {
 public:
  /// In the order they were fired.
  void add(const FiredTrigger& trigger) { triggers_.push_back(trigger); }
  /// In the order of their stamps, on the joints' clock. A frame may come before its trigger is reported.
  void add_frame(Stamp middle, Duration exposure) { frames_.push_back({middle, exposure}); }
  /// Pairs what can be paired.
  void settle(Stamp now);
  /// What still waits gets no partner.
  void finish();

  /// From trigger() to mid-exposure: the median of the last few; nothing while there are none.
  std::optional<Duration> delay() const;
  /// The distance of mid-exposures from the wanted time that this share does not exceed [s].
  double timing_error(double share) const;

  /// When the oldest waiting trigger was fired, if several wait for a frame.
  std::optional<Stamp> unanswered_since() const {
    return triggers_.size() < kSeveral ? std::nullopt : std::optional(triggers_.front().fired);
  }
  std::uint64_t lost() const { return lost_; }
  std::uint64_t untriggered() const { return untriggered_; }  ///< frames that belong to no trigger
  std::uint64_t pairs() const { return errors_.size(); }

 private:
  static constexpr std::size_t kSeveral = 3;
  struct Exposed {
    Stamp middle;
    Duration exposure;
  };

  bool pair(const Exposed& frame);

  std::deque<FiredTrigger> triggers_;
  std::deque<Exposed> frames_;
  std::deque<Duration> delays_;
  std::vector<double> errors_;
  std::uint64_t lost_ = 0, untriggered_ = 0;
};

}  // namespace tankrig
