// The wires between the program and a watchdog box.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "core/result.hpp"
#include "drivers/watchdog/watchdog_settings.hpp"

namespace tankrig {

/// Threads: one.
class HeartbeatLine {
 public:
  virtual ~HeartbeatLine() = default;
  /// The line's next edge. May take the time of a transfer on the adapter's bus.
  virtual Status edge() noexcept = 0;
};

/// Threads: one.
class EnableLine {
 public:
  virtual ~EnableLine() = default;
  /// Whether the box feeds arm and laser; nothing if it has not said so since the last call.
  virtual Result<std::optional<bool>> read() noexcept = 0;
};

/// Either may be missing. Both may be ends of the same line.
struct WatchdogLines {
  std::shared_ptr<HeartbeatLine> heartbeat;
  std::shared_ptr<EnableLine> enable;
};

/// Opens what the settings name; `runtime/` is in `runtime`.
/// Errors: InputError that says what to do: SerialPort's, a line without control lines, kinds that do not go together.
WatchdogLines open_watchdog_lines(const WatchdogSettings& settings, const std::filesystem::path& runtime);

}  // namespace tankrig
