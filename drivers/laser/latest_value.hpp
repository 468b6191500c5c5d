// The newest value of a device thread, for a cycle that must not wait for it.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace tankrig {

/// Three slots: one is the writer's, one the reader's, and the third has the newest complete value.
/// Threads: one writer, one reader.
/// RT: both wait-free.
template <class T>
class LatestValue {
 public:
  void publish(const T& value) noexcept {
    slots_[writing_] = value;
    writing_ = shared_.exchange(static_cast<std::uint8_t>(writing_ | kFresh), std::memory_order_acq_rel) & kSlot;
  }

  /// A default T before the first publish().
  const T& latest() noexcept {
    if (shared_.load(std::memory_order_relaxed) & kFresh)
      reading_ = shared_.exchange(reading_, std::memory_order_acq_rel) & kSlot;
    return slots_[reading_];
  }

 private:
  static constexpr std::uint8_t kFresh = 4, kSlot = 3;
  std::array<T, 3> slots_{};
  std::uint8_t writing_ = 0, reading_ = 1;
  std::atomic<std::uint8_t> shared_{2};
};

}  // namespace tankrig
