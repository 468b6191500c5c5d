// What is recorded, on its way to disk: a bounded ring, the thread that writes it out, and the one that sees it onto
// the disk.
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

/// A thread does not come back from the disk: it is left behind with what it still holds, and nothing more may be
/// written to this session, or whoever writes it would hang as well. What is on the disk opens, and can be recovered.
class DiskHangs : public NotOnDisk {
 public:
  using NotOnDisk::NotOnDisk;
};

/// How long a thread may take for one call before the disk is given up. A sync may have to wait for what other
/// programs have written.
struct DiskPatience {
  Duration write = std::chrono::seconds(5), sync = std::chrono::seconds(60);
};

/// Frames go into the spool, lines into their tables ten times a second; twice a second all of it is sent to the disk
/// itself, so that a kill loses tenths of a second and a power cut the last second, as far as the disk keeps up. A
/// write or a sync that fails ends the recording: what comes after it is counted, and a reserve on the disk is freed
/// for the last lines and session.yaml.
/// Threads: add_* and finish from one; they wait for the disk only if `wait`.
/// RT: never, but it holds no lock while it writes.
/// Errors: a thread's failure (CannotWrite naming the file) is thrown by the next add_* and by finish, the first one,
/// or NotOnDisk if a sync failed at all; so is a disk that does not come back from one write for `patience.write`.
class DiskThreads {
 public:
  /// Opens the tables with their headers and starts the threads.  `ring_bytes` of frames may wait, and a minute of
  /// lines; the session stays locked as long as a thread may write to it.
  static std::shared_ptr<DiskThreads> start(std::filesystem::path session, std::shared_ptr<SessionLock> lock,
                                            std::size_t ring_bytes, bool wait, const DiskPatience& patience);
  DiskThreads(const DiskThreads&) = delete;
  DiskThreads& operator=(const DiskThreads&) = delete;

  /// False: the ring is full, and the line forgotten.
  bool add_line(RecordedTable table, std::string_view line);
  /// Shares `image`: nobody writes to it any more. False: the ring is full, and the frame forgotten.
  bool add_frame(const std::string& camera, std::string line, const cv::Mat& image);

  /// Returns when everything is on the disk that can be; must be called. No add_* after it. Errors also: DiskHangs if a
  /// thread shows no sign of life for as long as `patience` says.
  void finish();

  /// After finish, unless the disk hangs: frames on disk, and frames the disk refused, by camera.
  const std::map<std::string, std::uint64_t>& written() const { return written_; }
  const std::map<std::string, std::uint64_t>& refused() const { return refused_; }
  /// Likewise: every frame on disk has its line in frames.csv. Else only the spool knows them.
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
