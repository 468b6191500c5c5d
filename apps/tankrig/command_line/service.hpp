// What a service manager is told: that the arm is supervised, and that whoever supervises it still does.
#pragma once

#include <optional>
#include <string>

#include "core/time.hpp"

namespace tankrig::app {

/// The protocol of sd_notify(3), where systemd asked for it (NOTIFY_SOCKET, WATCHDOG_USEC): ready from construction on;
/// from then to destruction alive() must be called, else systemd ends the program with SIGABRT, whose last resort makes
/// safe.
/// Threads: one.
class ServiceNotice {
 public:
  explicit ServiceNotice(Stamp now);
  ~ServiceNotice();
  ServiceNotice(const ServiceNotice&) = delete;
  ServiceNotice& operator=(const ServiceNotice&) = delete;

  /// Says so three times in the watchdog's time, however often it is called.
  void alive(Stamp now) noexcept;

 private:
  void tell(const std::string& words) const noexcept;

  std::string socket_;                ///< empty: nobody asked
  std::optional<Duration> watchdog_;  ///< none: no watchdog
  Stamp next_;
};

}  // namespace tankrig::app
