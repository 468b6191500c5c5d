// Memory locked in place, so that a time-critical thread never waits for a page.
#pragma once

namespace tankrig {

/// Whether this process may lock all its memory: it has CAP_IPC_LOCK, or no limit (`ulimit -l`).
bool may_lock_memory() noexcept;

/// From now on the heap returns nothing to the system: filling a fresh page costs as much as working on one.
void keep_freed_memory() noexcept;

/// While it lives, mapped memory stays in RAM; later mappings stay from their first touch on. The heap returns nothing
/// to the system and has a touched reserve, from construction to the end of the program. Does nothing if
/// may_lock_memory() is false: a later allocation would hit the limit.
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

/// Touches the 256 kB of stack that the calling thread will use.
void touch_stack() noexcept;

}  // namespace tankrig
