// How threads that keep time ask for the processor.
#pragma once

namespace tankrig {

/// Gives the calling thread SCHED_FIFO at `priority` (1 .. 99) and a name of at most 15 characters. Where the system
/// does not allow it the thread stays as it was, and works on an idle machine. True if it was allowed.
bool set_fifo(const char* name, int priority) noexcept;

/// Runs the calling thread on processor `cpu` only. False, and nothing changed, if it may not or there is no such one.
bool pin_to_cpu(int cpu) noexcept;

}  // namespace tankrig
