// What the kernel tests do to the guest they run in: programs, interfaces, faults. They are root there.
#pragma once

#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/time.hpp"
#include "drivers/can/can_bus.hpp"

namespace tankrig::test {

/// Runs a shell command and returns what it printed.
/// Errors: std::runtime_error with the output if it fails.
std::string shell(const std::string& command);

/// A program that runs until the end of the scope.
class Background {
 public:
  /// Output goes to `output`, a file, where given.
  /// Errors: std::runtime_error.
  explicit Background(const std::vector<std::string>& command, const std::string& output = {});
  ~Background();
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;
  void kill(int signal) noexcept;
  /// Exit status, -1 if it has not ended by itself after ten seconds (it is killed then).
  int wait() noexcept;

 private:
  pid_t pid_;
};

/// Asks once a millisecond; false if it has not come true after `limit`.
bool becomes_true(const std::function<bool()>& condition, Duration limit = std::chrono::seconds(20));

/// "up type can bitrate 500000 restart-ms 200" or the like, after `ip link set INTERFACE`.
void set_link(const std::string& interface, const std::string& what);

/// On rigcan0 or rigcan1: see rigcan/rigcan.c.
void set_fault(const std::string& interface, std::string_view fault);

/// Does anybody listen on `interface` (or on every one: "any") with a raw socket?
bool has_listener(const std::string& interface);

CanFrame frame_of(std::uint16_t id, const std::vector<std::uint8_t>& data);

/// Sends, in time: the kernel's queue may refuse for up to a second after its interface has come up.
bool send_within(CanBus& bus, const CanFrame& frame, Duration limit = std::chrono::seconds(20));

/// The next frame, if one comes in time; error frames on the way are taken in by the bus.
std::optional<CanFrame> receive_within(CanBus& bus, Duration limit = std::chrono::seconds(20));

/// Reads what waits until `state` is told; errors on the way are expected.
bool reaches(CanBus& bus, CanState state, Duration limit = std::chrono::seconds(20));

}  // namespace tankrig::test
