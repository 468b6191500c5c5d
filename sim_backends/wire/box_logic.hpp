// What a watchdog box decides: when it lets its two contactors close, and when it drops them.
#pragma once

#include "core/time.hpp"

namespace tankrig::sim {

/// As docs/reference/watchdog_box.md specifies. Both contactors are one here: closed means both.
/// Threads: one.
class BoxLogic {
 public:
  static constexpr Duration kLongestGap = std::chrono::milliseconds(150);  ///< between two edges
  static constexpr Duration kShortestGap = std::chrono::milliseconds(2);   ///< an oscillation is no heartbeat
  static constexpr int kEdgesForReset = 10;                                ///< good ones in a row
  static constexpr Duration kFeedback = std::chrono::milliseconds(100);    ///< a coil's contact follows within

  /// An edge came, or a numbered frame: those may come several at once, as an adapter hands them on.
  void edge(Stamp now, bool numbered = false) noexcept {
    const Duration gap = now - last_edge_;
    const bool good = edges_ == 0 || ((numbered || gap >= kShortestGap) && gap <= kLongestGap);
    edges_ = good ? edges_ + 1 : 1;
    if (!good) drop(now);
    last_edge_ = now;
  }
  /// The button as it is now: only its way down counts, and only while the beats are good.
  void button(bool pressed, Stamp now) noexcept {
    if (pressed && !pressed_ && ready() && !stuck_ && !stopped_) {
      coil_ = true;
      switched_ = now;
    }
    pressed_ = pressed;
  }
  /// The stop's channels, in series with the coils: open, they drop, and stay so until the button is pressed again.
  void stop(bool open, Stamp now) noexcept {
    stopped_ = open;
    if (open) drop(now);
  }
  /// Time passes; `contact_closed`: the contactors' feedback. A box that finds its button pressed or a contact closed at
  /// power-up does nothing for either.
  void tick(bool contact_closed, Stamp now) noexcept {
    if (edges_ > 0 && now - last_edge_ > kLongestGap) {
      edges_ = 0;
      drop(now);
    }
    if (contact_closed != coil_ && now - switched_ > kFeedback) {
      stuck_ = true;
      drop(now);
    }
  }

  /// The coils' supply.
  bool coil() const noexcept { return coil_; }
  bool ready() const noexcept { return edges_ >= kEdgesForReset; }
  /// For good: until the box is repaired.
  bool stuck() const noexcept { return stuck_; }

 private:
  void drop(Stamp now) noexcept {
    if (coil_) switched_ = now;
    coil_ = false;
  }

  int edges_ = 0;  // good ones in a row
  Stamp last_edge_{}, switched_{};
  bool coil_ = false, pressed_ = true, stuck_ = false, stopped_ = false;
};

}  // namespace tankrig::sim
