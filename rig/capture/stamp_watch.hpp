// Whether a camera's clock has jumped, by the stamps of its frames.
#pragma once

#include <fmt/format.h>

#include <optional>
#include <string>

#include "drivers/camera/camera.hpp"
#include "rig/sync/sync_gate.hpp"

namespace tankrig {

/// A stamp after the frame's arrival, or before the previous stamp, means that the clock has jumped: later frames would
/// silently be joined to the wrong joints. Not noticed: a jump back by less than a frame's period, or ahead by less
/// than kMostOffset plus the frame's transfer time.
/// Threads: one.
class StampWatch {
 public:
  static constexpr Duration kMostOffset = std::chrono::milliseconds{100};  ///< of an uncalibrated camera

  /// What is wrong with the next frame's stamp, as given by its driver; empty: nothing. Errors within the stamp's own
  /// sigma are left to the sync gate.
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
