// A measurement in a process of its own: whatever becomes of it, the next one is made.
#pragma once

#include <functional>
#include <mutex>
#include <string>

namespace tankrig::scenarios {

/// A line of the page, what is wrong with it, and why it was not judged.
struct Measured {
  std::string line, status, why, skipped;
};

/// `measure` runs in a child, which is killed if it takes longer than `longest_s`. Its death or an exception is what is
/// wrong then; `line` is empty. `alone` is held while it forks: hold it to print, and the child finds the streams free.
/// Threads: any.
Measured measured_apart(const std::function<Measured()>& measure, unsigned longest_s, std::mutex& alone);

}  // namespace tankrig::scenarios
