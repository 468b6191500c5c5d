#include "rig/platform/real_time.hpp"

#include <thread>

#include "core/input_error.hpp"
#include "core/locked_memory.hpp"
#include "core/thread_priority.hpp"

namespace tankrig {

RealTimeGrant become_real_time(const RealTimeSettings& settings) noexcept {
  RealTimeGrant granted;
  granted.cpu = !settings.cpu || pin_to_cpu(*settings.cpu);
  granted.fifo = set_fifo("tankrig-cycle", settings.priority);
  touch_stack();
  return granted;
}

std::string missing_real_time(const RealTimeSettings& settings) {
  RealTimeGrant granted;
  std::thread([&] { granted = become_real_time(settings); }).join();
  std::string missing;
  const auto add = [&](const std::string& what) { missing += (missing.empty() ? "" : ", ") + what; };
  if (!granted.fifo) add("SCHED_FIFO at priority " + std::to_string(settings.priority));
  if (settings.lock_memory && !may_lock_memory()) add("locked memory without limit");
  const bool rights = !missing.empty();
  if (!granted.cpu) add("processor " + std::to_string(*settings.cpu));
  if (missing.empty()) return {};
  std::string cure;
  if (rights) cure = "put etc/limits.d/tankrig.conf into /etc/security/limits.d and log in again, or use setcap";
  if (!granted.cpu) cure += (cure.empty() ? "" : "; ") + std::string("correct scan.real_time.cpu");
  return "not granted: " + missing + ": " + cure + " (docs/reference/real_time.md)";
}

std::string check_real_time(const RealTimeSettings& settings) {
  std::string missing = missing_real_time(settings);
  if (!missing.empty() && settings.required)
    throw InputError("scan: real time " + missing + "; scan.real_time.required: false goes without it");
  return missing;
}

}  // namespace tankrig
