// What is recorded, on its way to disk: a bounded ring, the thread that writes it out, and the one that sees it onto
// the disk.
#pragma once

#include <array>
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

#include "core/sign_of_life.hpp"
#include "rig/session/spool.hpp"
#include "rig/session/text_files.hpp"

namespace tankrig {

enum class RecordedTable : std::uint8_t { kJointLines, kFrameLines, kEventLines };

/// Frames go into the spool, lines into their tables ten times a second; twice a second all of it is sent to the disk
/// itself, so that a kill loses tenths of a second and a power cut the last second, as far as the disk keeps up.
/// A write error ends the recording: the first one is kept, what comes after it is counted, and a reserve on the disk
/// is freed for the last lines and session.yaml. Threads: add_* and finish from one; they wait for the disk only if
/// `wait`. RT: never, but it holds no lock while it writes. Errors: the first failure of a thread (InputError naming
/// the file) is thrown by the next add_* and by finish; so is a disk that does not come back from one write for
/// `patience`.
class DiskThread {
 public:
  /// Opens the tables with their headers.  `ring_bytes` of frames may wait, and a minute of lines.
  DiskThread(std::filesystem::path session, std::size_t ring_bytes, bool wait,
             Duration patience = std::chrono::seconds(5));
  ~DiskThread();
  DiskThread(const DiskThread&) = delete;
  DiskThread& operator=(const DiskThread&) = delete;

  /// False: the ring is full, and the line forgotten.
  bool add_line(RecordedTable table, std::string_view line);
  /// Shares `image`: nobody writes to it any more. False: the ring is full, and the frame forgotten.
  bool add_frame(const std::string& camera, std::string line, const cv::Mat& image);

  /// Returns when everything is written that can be. No add_* after it.
  void finish();

  /// After finish: frames on disk, and frames the disk refused, by camera.
  const std::map<std::string, std::uint64_t>& written() const { return written_; }
  const std::map<std::string, std::uint64_t>& refused() const { return refused_; }

 private:
  static constexpr std::size_t kTables = 3;
  struct Job {
    std::string camera, line;
    cv::Mat image;
    std::size_t bytes() const { return image.total() * image.elemSize(); }
  };
  void write_loop();
  void sync_loop();
  void write_frame(const Job& job);
  void write_lines();
  void sync_now();
  void stop();
  void failed();
  void rethrow();
  void check_alive();

  const std::filesystem::path session_;
  const std::size_t ring_bytes_;
  const bool wait_;
  std::vector<std::unique_ptr<AppendFile>> tables_;  // the writing thread's, but for their descriptors

  std::mutex mutex_;
  std::condition_variable room_, work_, sync_;
  std::deque<Job> jobs_;
  std::size_t waiting_bytes_ = 0, waiting_text_ = 0;
  std::array<std::string, kTables> lines_;
  std::vector<std::shared_ptr<SpoolWriter>> unsynced_;  // segments; the last may still grow
  std::exception_ptr failure_;
  bool closing_ = false, written_out_ = false;

  bool first_sync_ = true;  // the syncing thread's
  std::uint64_t next_number_ = 0;
  int next_segment_ = 0;
  std::shared_ptr<SpoolWriter> segment_;
  std::map<std::string, std::uint64_t> written_, refused_;
  SignOfLife writer_life_;
  std::thread writer_, syncer_;
};

}  // namespace tankrig
