// The guardian's process, as the program that it guards sees it.
#pragma once

#include <sys/types.h>

#include <functional>
#include <string>
#include <vector>

#include "core/stall_detector.hpp"
#include "rig/guardian/guardian.hpp"
#include "rig/guardian/guardian_memory.hpp"
#include "rig/safety/step_watch.hpp"

namespace tankrig {

/// Starts the guardian, hands it the lines and tells it of every safety step. If it has taken over, or has not been
/// seen for kMissed, that is an objection: nothing may move or shine any more.
/// Threads: as StepWatch; the functions of line() any.
class GuardianProcess final : public StepWatch {
 public:
  static constexpr Duration kMissed = std::chrono::seconds{1};

  /// This very program with `arguments` and, last, "--control N --memory N", in a session of its own. Waits for nothing.
  /// Errors: InputError if it cannot be started.
  explicit GuardianProcess(std::vector<std::string> arguments);
  /// An orderly end if release() was called since the last step; else the guardian makes safe. Waits for the former.
  ~GuardianProcess() override;
  GuardianProcess(const GuardianProcess&) = delete;
  GuardianProcess& operator=(const GuardianProcess&) = delete;

  /// What is to be told whenever that line has been opened (SerialSettings::opened). It must not outlive this.
  std::function<void(int)> line(GuardianLine which) const;
  /// Waits until it has all lines and watches.
  /// Errors: InputError if it does not.
  void wait_until_ready();
  /// Set by the guardian when it takes over: whoever sends demands looks before.
  const std::atomic<bool>& taken_over() const noexcept { return memory_.words().taken_over; }
  pid_t process() const noexcept { return process_; }

  void begin(Duration patience) noexcept override;
  const char* objection(Stamp now) noexcept override;
  void completed(const OutputRight& right) noexcept override;
  void release() noexcept override;

 private:
  GuardianMemory memory_;
  OwnedDescriptor control_;
  pid_t process_ = -1;
  std::atomic<bool> released_{true};
  StallDetector silence_{std::chrono::milliseconds{20}};  // the cycle's
  const char* objection_ = nullptr;                       // the cycle's
};

}  // namespace tankrig
