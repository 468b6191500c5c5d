// Whether the stamps of a camera's frames go with time: its clock may jump.
#pragma once

#include <fmt/format.h>

#include <optional>
#include <string>

#include "drivers/camera/camera.hpp"
#include "rig/sync/sync_gate.hpp"

namespace tankrig {

/// A frame that is stamped after it came, or before the one before it, was stamped by a clock that has jumped, and what
/// follows would be joined to the joints of another time without a word.  Not noticed: back by less than a frame's
/// period, ahead by less than kMostOffset and the time a frame takes to come.
/// Threads: one.
class StampWatch {
 public:
  static constexpr Duration kMostOffset = std::chrono::milliseconds{100};  ///< of a camera that is not calibrated yet

  /// What is wrong with the next frame, as its driver stamped it; empty: nothing. What a stamp's own sigma allows is
  /// the sync gate's to refuse.
  std::string judge(const Frame& frame, Stamp arrival) {
    const Duration slack = allowed(frame.stamp_sigma);
    if (const Duration ahead = frame.stamp - arrival; ahead > kMostOffset + slack) return told(ahead, "after it came");
    if (newest_)
      if (const Duration back = *newest_ - frame.stamp; back > slack + newest_slack_)
        return told(back, "before the one before it");
    newest_ = frame.stamp;
    newest_slack_ = slack;
    return {};
  }

 private:
  static Duration allowed(Duration sigma) { return from_seconds(SyncGate::worst({}, sigma)); }

  static std::string told(Duration wrong, const char* what) {
    return fmt::format("its clock jumped: a frame stamped {:.0f} ms {}", 1e3 * seconds(wrong), what);
  }

  std::optional<Stamp> newest_;
  Duration newest_slack_{};
};

}  // namespace tankrig
