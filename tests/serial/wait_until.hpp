// Waits for what another thread or process does.
#pragma once

#include <chrono>
#include <thread>

namespace tankrig {

/// True as soon as `condition` holds; false if it does not within `limit`, which is generous: a loaded machine is no
/// failure.
template <class Condition>
bool wait_until(Condition condition, std::chrono::milliseconds limit = std::chrono::seconds{20}) {
  const auto last = std::chrono::steady_clock::now() + limit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > last) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
  }
  return true;
}

}  // namespace tankrig
