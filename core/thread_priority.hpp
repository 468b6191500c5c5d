// Scheduling of time-critical threads.
#pragma once

namespace tankrig {

/// Gives the calling thread SCHED_FIFO at `priority` (1 .. 99) and a name of at most 15 characters. Returns false and
/// leaves the scheduling as it is if the system does not allow it; on an idle machine the thread still works.
bool set_fifo(const char* name, int priority) noexcept;

/// Gives the calling thread ordinary scheduling again: what it still does is not urgent.
void set_ordinary() noexcept;

/// Names the calling thread and gives it a tenth of what an ordinary one gets where both want the processor: for work that can
/// wait.
void set_background(const char* name) noexcept;

/// Pins the calling thread to processor `cpu`. Returns false and changes nothing if it may not or there is none.
bool pin_to_cpu(int cpu) noexcept;

}  // namespace tankrig
