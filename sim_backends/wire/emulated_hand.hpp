// Somebody at the emulated tank, who opens its lid and presses its stop when asked.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <thread>

#include "drivers/can/owned_descriptor.hpp"

namespace tankrig::sim {

enum class HandDeed : std::uint8_t { kOpenLid, kCloseLid, kPressStop, kReleaseStop };

/// Asked by a datagram of one byte.
/// Threads: `does` runs in its own.
class EmulatedHand {
 public:
  /// Errors: InputError if `socket` cannot be made.
  EmulatedHand(const std::filesystem::path& socket, std::function<void(HandDeed)> does);
  ~EmulatedHand();
  EmulatedHand(const EmulatedHand&) = delete;
  EmulatedHand& operator=(const EmulatedHand&) = delete;

 private:
  void run();

  const std::filesystem::path socket_;
  const std::function<void(HandDeed)> does_;
  OwnedDescriptor listens_;
  std::atomic<bool> ends_{false};
  std::thread thread_;  // last: it uses all of the above
};

/// False: nobody is there.
bool ask_hand(const std::filesystem::path& socket, HandDeed deed) noexcept;

}  // namespace tankrig::sim
