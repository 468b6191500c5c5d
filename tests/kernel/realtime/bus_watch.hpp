// Counts the frames on a CAN interface: those of each cycle, and all of them by the kernel's own account.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "drivers/arm/can_arm_link.hpp"
#include "rig/executive/cycle_listener.hpp"

namespace tankrig::test {

/// How many cycles had so many frames; the last place: so many or more.
using FrameHistogram = std::array<std::uint64_t, 16>;

/// A third node on the bus, which hears both others. A request is the cycle's that sent it, and so is all that is
/// answered until the next one.
/// RT: cycle() waits for nothing.
class BusWatch final : public CycleListener {
 public:
  /// `cycles`: at most so many are counted.
  /// Errors: as open_can().
  BusWatch(const std::string& interface, int bitrate, const ArmCanIds& ids, std::size_t cycles, const Clock& clock);

  void cycle(const CycleRecord& record) noexcept override;
  /// Once the last cycle's answer must have come: what is still unread.
  void finish() noexcept { take(begun_); }

  /// Of the cycles that were.
  FrameHistogram frames_a_cycle() const;
  /// Frames nobody could count: the socket's buffer was full, or there were more cycles than announced.
  std::uint64_t lost() const noexcept;

 private:
  void take(std::size_t cycle) noexcept;

  ArmCanIds ids_;
  std::unique_ptr<CanBus> bus_;
  std::vector<std::uint32_t> frames_;  ///< by cycle
  std::size_t begun_ = 0;              ///< cycles
  std::uint64_t uncounted_ = 0;
};

/// Sent on `interface` since it exists, by anybody, as the kernel counts them, once nobody sends for 5 ms.
/// Errors: std::runtime_error if it never falls silent.
std::uint64_t frames_once_silent(const std::string& interface);

}  // namespace tankrig::test
