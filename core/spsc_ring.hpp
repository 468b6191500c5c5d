// A fixed-size ring with one writer and one reader: the only door out of the cycle and into a device thread.
#pragma once

#include <atomic>
#include <cstddef>
#include <vector>

namespace tankrig {

/// Threads: one writer (try_push), one reader (try_pop).
/// RT: both are safe and never block; memory is allocated at construction, and assigning a T must not allocate.
template <class T>
class SpscRing {
 public:
  explicit SpscRing(std::size_t capacity) : slots_(capacity + 1) {}

  /// False if full: the element is dropped, and the caller counts it.
  bool try_push(const T& element) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    const std::size_t next = (head + 1) % slots_.size();
    if (next == tail_.load(std::memory_order_acquire)) return false;
    slots_[head] = element;
    head_.store(next, std::memory_order_release);
    return true;
  }

  /// False if empty.
  bool try_pop(T& element) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == head_.load(std::memory_order_acquire)) return false;
    element = slots_[tail];
    tail_.store((tail + 1) % slots_.size(), std::memory_order_release);
    return true;
  }

 private:
  std::vector<T> slots_;
  alignas(64) std::atomic<std::size_t> head_{0};
  alignas(64) std::atomic<std::size_t> tail_{0};
};

}  // namespace tankrig
