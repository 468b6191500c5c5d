// can.log: all traffic on the bus, as `candump -L` writes it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <thread>

#include "drivers/can/can_carrier.hpp"
#include "drivers/can/open_can.hpp"

namespace tankrig {

struct CanRecorderCounters {
  std::uint64_t recorded = 0;         ///< frames in the file
  std::uint64_t receive_dropped = 0;  ///< by the recorder's own socket: the disk or the processor was late
  std::uint64_t malformed = 0;        ///< datagrams that are no frame
  std::uint64_t lost_to_disk = 0;     ///< frames without room in memory while the disk hung
  std::uint64_t write_errors = 0;     ///< failed attempts to write
  std::uint64_t reopened = 0;
  int disk_errno = 0;  ///< of the last failed attempt, e.g. ENOSPC
};

/// A listening node of its own: all frames, including the rig's, error frames and CAN FD. Written at least every half
/// second, so a kill loses no more. A full disk is retried, and frames wait in memory while there is room. An interface
/// that goes away is waited for.
/// Threads: its own; counters() and the rest from any.
/// RT: never.
class CanRecorder {
 public:
  static constexpr std::size_t kMostBytesWaiting = 4 << 20;

  /// Creates `file`, or continues after its last whole line. `patience`: how long stop() waits for the disk.
  /// Errors: InputError, as open_can(), or for the file.
  CanRecorder(const CanSettings& settings, const std::filesystem::path& file,
              Duration patience = std::chrono::seconds(5));
  ~CanRecorder();
  CanRecorder(const CanRecorder&) = delete;
  CanRecorder& operator=(const CanRecorder&) = delete;

  /// Writes what has been received so far, and ends. A thread whose disk hangs is left behind with its unwritten
  /// frames: write_errors and disk_errno (ETIMEDOUT) say so.
  void stop();
  CanRecorderCounters counters() const noexcept;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;  ///< its thread's too
  const Duration patience_;
  std::thread thread_;
};

}  // namespace tankrig
