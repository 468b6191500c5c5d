// What the guardian and the program it guards see of each other, in memory that outlives either.
#pragma once

#include <atomic>
#include <cstdint>

#include "core/time.hpp"
#include "drivers/can/owned_descriptor.hpp"

namespace tankrig {

/// One writer for each value.
struct GuardianWords {
  // The program's.
  std::atomic<std::uint64_t> steps{0};    ///< completed safety steps
  std::atomic<bool> watched{false};       ///< a step was completed, and rest is not confirmed since
  std::atomic<std::int64_t> patience_ns;  ///< longest time between two steps
  // The guardian's.
  std::atomic<std::uint64_t> rounds{0};  ///< grows while the guardian lives
  std::atomic<bool> taken_over{false};   ///< for good
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

/// A mapping of the words; its size is sealed, so neither process can take it from the other.
/// Threads: any.
class GuardianMemory {
 public:
  /// New memory, all zero.
  /// Errors: std::system_error.
  GuardianMemory();
  /// That of another process.
  /// Errors: std::system_error.
  explicit GuardianMemory(OwnedDescriptor descriptor);
  ~GuardianMemory();
  GuardianMemory(const GuardianMemory&) = delete;
  GuardianMemory& operator=(const GuardianMemory&) = delete;

  GuardianWords& words() const noexcept { return *words_; }
  int descriptor() const noexcept { return descriptor_.get(); }

 private:
  void map();

  OwnedDescriptor descriptor_;
  GuardianWords* words_ = nullptr;
};

}  // namespace tankrig
