// Out of reach of what stops the guarded program.
#pragma once

namespace tankrig {

/// Moves this process to a control group of its own beside the one it is in (version 2), so that freezing the program's
/// does not freeze this one. False, and stays, where the system does not allow it.
bool leave_the_cgroup() noexcept;

/// Gives this process the lowest score for the out-of-memory killer that the system allows.
bool spare_from_out_of_memory() noexcept;

}  // namespace tankrig
