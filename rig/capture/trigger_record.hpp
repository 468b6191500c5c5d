// Triggers held against the frames that came of them: delay, losses.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "rig/capture/trigger_thread.hpp"

namespace tankrig {

/// Of one camera. A frame belongs to the last trigger before its exposure began; triggers before that which have no
/// frame are lost. So a camera must begin to expose before its next trigger.
/// Threads: one.
/// RT: never.
class TriggerRecord {
 public:
  /// In the order they were fired.
  void add(const FiredTrigger& trigger) { triggers_.push_back(trigger); }
  /// In the order of their stamps, on the joints' clock. It may come before its trigger is told of.
  void add_frame(Stamp middle, Duration exposure) { frames_.push_back({middle, exposure}); }
  /// Pairs what can be paired.
  void settle(Stamp now);
  /// What still waits will have no partner.
  void finish();

  /// From trigger() to mid-exposure: the median of the last few, once there are some.
  std::optional<Duration> delay() const;
  /// How far mid-exposures were from where they were wanted; this share is not further [s].
  double timing_error(double share) const;

  /// When the oldest of the triggers that wait for a frame was fired, if there are several.
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
