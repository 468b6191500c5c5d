// can.log: everything that passes on the bus, written as `candump -L` would.
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
  std::uint64_t lost_to_disk = 0;     ///< frames that found no room in memory while the disk took nothing
  std::uint64_t write_errors = 0;     ///< failed attempts to write
  std::uint64_t reopened = 0;
  int disk_errno = 0;  ///< of the last failed attempt, e.g. ENOSPC
};

/// A node of its own that only listens: all frames, those the rig sends included, error frames, CAN FD. Written out at
/// least every half second, so a kill costs no more; a disk that is full is tried again, and its frames kept in memory
/// while there is room. An interface that goes away is waited for.
/// Threads: a thread of its own; counters() and the rest from any.
/// RT: never.
class CanRecorder {
 public:
  static constexpr std::size_t kMostBytesWaiting = 4 << 20;

  /// Creates `file`, or goes on behind its last whole line. `patience`: how long stop() waits for the disk.
  /// Errors: InputError, as open_can(), or for the file.
  CanRecorder(const CanSettings& settings, const std::filesystem::path& file,
              Duration patience = std::chrono::seconds(5));
  ~CanRecorder();
  CanRecorder(const CanRecorder&) = delete;
  CanRecorder& operator=(const CanRecorder&) = delete;

  /// Takes what has been received so far, writes it and ends. A thread whose disk hangs is left behind, with the frames
  /// it has not written: write_errors and disk_errno (ETIMEDOUT) say so.
  void stop();
  CanRecorderCounters counters() const noexcept;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;  ///< its thread's too
  const Duration patience_;
  std::thread thread_;
};

}  // namespace tankrig
