// The recorder's way to disk: a bounded ring, a thread that writes, and a thread that syncs.
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "core/atomic_file.hpp"
#include "core/stall_detector.hpp"
#include "core/text_files.hpp"
#include "session/recording/session_lock.hpp"
#include "session/recording/spool.hpp"

namespace tankrig {

enum class RecordedTable : std::uint8_t { kJointLines, kFrameLines, kEventLines };

/// A disk thread hangs. It is left behind with what it still holds. Nothing more may be written to this session,
/// because that would hang too. What is on the disk can be opened and recovered.
class DiskHangs : public NotOnDisk {
 public:
  using NotOnDisk::NotOnDisk;
};

/// How long one call of a thread may take before the disk is given up. A sync may have to wait for other programs'
/// data.
struct DiskPatience {
  Duration write = std::chrono::seconds(5), sync = std::chrono::seconds(60);
};

/// Frames go to the spool and lines to their tables ten times a second; twice a second all of it is synced. So a kill
/// loses tenths of a second and a power cut the last second, if the disk keeps up.
/// A failed write or sync ends the recording: later data is counted, and a reserve on the disk is freed for the last
/// lines and session.yaml.
/// Threads: add_* and finish from one; they wait for the disk only if `wait`.
/// RT: never, but it holds no lock while it writes.
/// Errors: the next add_* and finish throw NotOnDisk if any sync failed, else a thread's first failure (CannotWrite
/// naming the file). add_* throws InputError if one write takes longer than `patience.write`.
class DiskThreads {
 public:
  /// Opens the tables with their headers and starts the threads. `ring_bytes` of frames may wait, and a minute of
  /// lines. The session stays locked as long as a thread may write to it.
  static std::shared_ptr<DiskThreads> start(std::filesystem::path session, std::shared_ptr<SessionLock> lock,
                                            std::size_t ring_bytes, bool wait, const DiskPatience& patience);
  DiskThreads(const DiskThreads&) = delete;
  DiskThreads& operator=(const DiskThreads&) = delete;

  /// False: the ring is full, and the line is lost.
  bool add_line(RecordedTable table, std::string_view line);
  /// Shares `image`, which nobody may write to any more. False: the ring is full, and the frame is lost.
  bool add_frame(const std::string& camera, std::string line, const cv::Mat& image);

  /// Returns when everything that can be is on the disk. Must be called; no add_* after it.
  /// Errors: as above, and DiskHangs if a thread makes no progress for as long as `patience` says.
  void finish();

  /// After finish, unless the disk hangs: frames on disk, and frames the disk refused, by camera.
  const std::map<std::string, std::uint64_t>& written() const { return written_; }
  const std::map<std::string, std::uint64_t>& refused() const { return refused_; }
  /// After finish: every frame on disk has its line in frames.csv. If false, only the spool knows them all.
  bool frame_lines_written() const { return frame_lines_written_; }

 private:
  static constexpr std::size_t kTables = 3;
  struct Job {
    std::string camera, line;
    cv::Mat image;
    std::size_t bytes() const { return image.total() * image.elemSize(); }
  };

  DiskThreads(std::filesystem::path session, std::shared_ptr<SessionLock> lock, std::size_t ring_bytes, bool wait,
              const DiskPatience& patience);
  void write_loop();
  void sync_loop();
  void write_frame(const Job& job);
  void write_lines();
  void sync_now(bool last);
  template <class Room>
  bool wait_for_room(std::unique_lock<std::mutex>& lock, Room room);
  bool wait_for_end(const bool& ended, const std::atomic<std::uint64_t>& rounds, Duration patience);
  void join();
  void failed();
  void rethrow();
  void check_alive();

  const std::filesystem::path session_;
  const std::shared_ptr<SessionLock> lock_;
  const std::size_t ring_bytes_;
  const bool wait_;
  const DiskPatience patience_;
  std::vector<std::unique_ptr<AppendFile>> tables_;  // the writing thread's, but for their descriptors

  std::mutex mutex_;
  std::condition_variable room_, work_, sync_, ended_;
  std::deque<Job> jobs_;
  std::size_t waiting_bytes_ = 0, waiting_text_ = 0;
  std::array<std::string, kTables> lines_;
  std::vector<std::shared_ptr<SpoolWriter>> unsynced_;  // segments; the last may still grow
  std::exception_ptr failure_, not_on_disk_;            // the first of any kind; the first sync's
  bool closing_ = false, written_out_ = false, synced_ = false;

  FileSystemSync file_system_;  // the syncing thread's
  bool first_sync_ = true;      // likewise
  std::uint64_t next_number_ = 0;
  int next_segment_ = 0;
  std::shared_ptr<SpoolWriter> segment_;
  std::map<std::string, std::uint64_t> written_, refused_;
  bool frame_lines_written_ = true;
  std::atomic<std::uint64_t> writer_rounds_{0}, syncer_rounds_{0};  // signs of life
  StallDetector writer_silence_;                                    // of add_*
  std::thread writer_, syncer_;                                     // each holds this object
};

}  // namespace tankrig
