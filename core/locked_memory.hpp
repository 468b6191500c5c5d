// Memory that stays where it is, so that a thread that keeps time never waits for a page.
#pragma once

namespace tankrig {

/// May this process lock all of its memory, whatever it will take? By CAP_IPC_LOCK, or no limit (`ulimit -l`).
bool may_lock_memory() noexcept;

/// While it lives, everything the process has mapped is in memory and stays there, and what it maps later stays from
/// its first touch on. From its beginning on the heap returns nothing to the system and has a reserve already touched;
/// that outlives it. Does nothing where may_lock_memory() is false: a limit would be met later, by an allocation.
/// Threads: one such object at a time.
class LockedMemory {
 public:
  LockedMemory() noexcept;
  ~LockedMemory();
  LockedMemory(const LockedMemory&) = delete;
  LockedMemory& operator=(const LockedMemory&) = delete;

  bool locked() const noexcept { return locked_; }

 private:
  bool locked_ = false;
};

/// Touches the part of the calling thread's stack that it will use: 256 kB.
void touch_stack() noexcept;

}  // namespace tankrig
