// Brings the arm to rest, again and again, and hears from its encoders whether it did.
#pragma once

#include <memory>
#include <optional>

#include "drivers/arm/arm5e_settings.hpp"
#include "drivers/arm/arm_link.hpp"
#include "rig/safety/still_watch.hpp"

namespace tankrig {

/// Sends nothing but rest. Every other demand differs where that means nothing, for an arm that went mute.
/// Threads: one.
/// RT: all but construction; a lost line is opened again, which may take its time.
class ArmRest {
 public:
  /// An arm at rest is one whose encoders stay within kFlicker ticks for kWindow, with the newest answer younger than
  /// kNewsAge.
  static constexpr int kFlicker = StillWatch::kFlicker;
  static constexpr Duration kWindow = StillWatch::kWindow, kNewsAge = StillWatch::kNewsAge;

  /// `limits`: the limits that every demand carries.
  ArmRest(std::unique_ptr<ArmLink> link, const Arm5eSettings& limits);

  /// Forgets what the encoders have said so far.
  void restart() noexcept { since_.reset(); }
  void ask(Stamp now) noexcept;
  /// Reads what has come.
  void listen(Stamp now) noexcept;
  bool rests(Stamp now) const noexcept { return since_ && heard_ - *since_ >= kWindow && now - heard_ <= kNewsAge; }
  bool lost() const noexcept { return link_->needs_reopen(); }
  ArmLink& link() noexcept { return *link_; }

 private:
  void take(const ArmAnswer& answer) noexcept;

  const std::unique_ptr<ArmLink> link_;
  ArmDemands rest_{};
  std::array<std::uint16_t, kJoints> first_{};  ///< the readings since when they have stayed
  std::array<int, kJoints> lowest_{}, highest_{};
  std::optional<Stamp> since_;
  Stamp heard_{};
};

}  // namespace tankrig
