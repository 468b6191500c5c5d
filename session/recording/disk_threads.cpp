#include "session/recording/disk_threads.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <pthread.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <system_error>
#include <utility>

#include "core/clock.hpp"
#include "session/reading/session_tables.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr auto kLinesPeriod = 100ms;
constexpr auto kSyncPeriod = 500ms;
constexpr std::size_t kTextBytes = 16 << 20;  // lines that may wait: a minute at 1 kHz
constexpr off_t kReserveBytes = 4 << 20;
constexpr std::array kTableNames{"joints.csv", "frames.csv", "events.csv"};

/// A disk is not given up in one look, after a while in which the program was suspended.
Duration longest_look(Duration patience) { return patience / 4; }

fs::path reserve_of(const fs::path& session) { return spool_folder(session) / "reserve"; }

/// Room on the disk for what must still be said when it is full.
void make_reserve(const fs::path& file) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
  const int error = descriptor < 0 ? errno : ::posix_fallocate(descriptor, 0, kReserveBytes);
  if (descriptor >= 0) ::close(descriptor);
  if (error != 0) throw CannotWrite(file, error);
}

}  // namespace

DiskThreads::DiskThreads(fs::path session, std::shared_ptr<SessionLock> lock, std::size_t ring_bytes, bool wait,
                         const DiskPatience& patience)
    : session_(std::move(session)),
      lock_(std::move(lock)),
      ring_bytes_(ring_bytes),
      wait_(wait),
      patience_(patience),
      file_system_(session_),
      writer_silence_(longest_look(patience.write), MonotonicClock{}.now()) {
  const std::array headers{joints_header(), frames_header(), events_header()};
  for (std::size_t i = 0; i < kTables; ++i) {
    tables_.push_back(std::make_unique<AppendFile>(session_ / kTableNames[i]));
    tables_[i]->append(headers[i]);
    tables_[i]->flush();
  }
  std::error_code failed;
  fs::create_directory(spool_folder(session_), failed);
  if (failed) throw InputError(spool_folder(session_), "cannot be created: " + failed.message());
  make_reserve(reserve_of(session_));
}

std::shared_ptr<DiskThreads> DiskThreads::start(fs::path session, std::shared_ptr<SessionLock> lock,
                                                std::size_t ring_bytes, bool wait, const DiskPatience& patience) {
  const std::shared_ptr<DiskThreads> disk(
      new DiskThreads(std::move(session), std::move(lock), ring_bytes, wait, patience));
  try {
    disk->writer_ = std::thread([disk] { disk->write_loop(); });
    disk->syncer_ = std::thread([disk] { disk->sync_loop(); });
  } catch (const std::system_error& e) {
    disk->join();
    throw InputError(disk->session_, std::string("no thread to write it: ") + e.what());
  }
  return disk;
}

template <class Room>
bool DiskThreads::wait_for_room(std::unique_lock<std::mutex>& lock, Room room) {
  while (wait_ && !room_.wait_for(lock, kLinesPeriod, room)) check_alive();
  rethrow();
  check_alive();
  return room();
}

bool DiskThreads::add_line(RecordedTable table, std::string_view line) {
  std::unique_lock lock(mutex_);
  const auto room = [&] { return waiting_text_ + line.size() <= kTextBytes || failure_; };
  if (!wait_for_room(lock, room)) return false;
  lines_[static_cast<std::size_t>(table)] += line;
  waiting_text_ += line.size();
  return true;
}

bool DiskThreads::add_frame(const std::string& camera, std::string line, const cv::Mat& image) {
  if (image.empty() || image.depth() != CV_8U || (image.channels() != 1 && image.channels() != 3))
    throw InputError(session_, "camera " + camera + ": expected an image of 8 bits and 1 or 3 channels");
  Job job{camera, std::move(line), image};
  std::unique_lock lock(mutex_);
  const auto room = [&] { return waiting_bytes_ + job.bytes() <= ring_bytes_ || jobs_.empty() || failure_; };
  if (!wait_for_room(lock, room)) return false;
  waiting_bytes_ += job.bytes();
  jobs_.push_back(std::move(job));
  work_.notify_one();
  return true;
}

/// False if the thread has shown no sign of life since this was asked, for `patience`.
bool DiskThreads::wait_for_end(const bool& ended, const std::atomic<std::uint64_t>& rounds, Duration patience) {
  const MonotonicClock clock;
  StallDetector silence(longest_look(patience), clock.now());
  std::unique_lock lock(mutex_);
  while (!ended_.wait_for(lock, kLinesPeriod, [&] { return ended; })) {
    silence.look(clock.now(), rounds);
    if (silence.stalled_for() > patience) return false;
  }
  return true;
}

void DiskThreads::finish() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  work_.notify_all();
  if (!wait_for_end(written_out_, writer_rounds_, patience_.write) ||
      !wait_for_end(synced_, syncer_rounds_, patience_.sync)) {
    writer_.detach();
    syncer_.detach();
    throw DiskHangs(session_, "the disk does not answer: what was not on it yet is lost");
  }
  join();
  segment_.reset();
  std::error_code ignored;
  if (fs::is_empty(spool_folder(session_), ignored)) fs::remove(spool_folder(session_), ignored);
  const std::lock_guard lock(mutex_);
  rethrow();
}

void DiskThreads::join() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  work_.notify_all();
  if (writer_.joinable()) writer_.join();
  if (syncer_.joinable()) syncer_.join();
}

void DiskThreads::failed() {
  const std::lock_guard lock(mutex_);
  if (!failure_) failure_ = std::current_exception();
  room_.notify_all();
}

void DiskThreads::rethrow() {
  if (not_on_disk_) std::rethrow_exception(not_on_disk_);
  if (failure_) std::rethrow_exception(failure_);
}

void DiskThreads::check_alive() {
  writer_silence_.look(MonotonicClock{}.now(), writer_rounds_);
  if (writer_silence_.stalled_for() <= patience_.write) return;
  failure_ = std::make_exception_ptr(InputError(session_, "the disk does not answer"));
  rethrow();
}

void DiskThreads::write_loop() {
  ::pthread_setname_np(::pthread_self(), "disk-writer");
  auto lines_due = std::chrono::steady_clock::now() + kLinesPeriod;
  std::unique_lock lock(mutex_);
  while (true) {
    ++writer_rounds_;
    work_.wait_until(lock, lines_due, [this] { return !jobs_.empty() || closing_; });
    ++writer_rounds_;
    const bool refuse = failure_ != nullptr;
    const bool last = closing_ && jobs_.empty();
    if (!jobs_.empty()) {
      const Job job = std::move(jobs_.front());
      jobs_.pop_front();
      lock.unlock();
      try {
        if (refuse)
          ++refused_[job.camera];
        else
          write_frame(job);
      } catch (...) {
        ++refused_[job.camera];
        failed();
      }
      lock.lock();
      waiting_bytes_ -= job.bytes();
      room_.notify_all();
    }
    if (!last && std::chrono::steady_clock::now() < lines_due) continue;
    lines_due = std::chrono::steady_clock::now() + kLinesPeriod;
    if (!failure_ || last) {
      lock.unlock();
      std::error_code ignored;
      if (last) fs::remove(reserve_of(session_), ignored);
      try {
        write_lines();
      } catch (...) {
        failed();
      }
      lock.lock();
    }
    if (!last) continue;
    written_out_ = true;
    sync_.notify_all();
    ended_.notify_all();
    return;
  }
}

void DiskThreads::write_frame(const Job& job) {
  if (!segment_ || segment_->bytes() >= kSegmentBytes) {
    segment_ = std::make_shared<SpoolWriter>(spool_folder(session_) / fmt::format("{:06}.raw", next_segment_++));
    const std::lock_guard lock(mutex_);
    unsynced_.push_back(segment_);
  }
  segment_->append(next_number_, job.line, job.image.isContinuous() ? job.image : job.image.clone());
  ++next_number_;
  ++written_[job.camera];
  const std::lock_guard lock(mutex_);
  lines_[static_cast<std::size_t>(RecordedTable::kFrameLines)] += job.line;  // already in the spool: needs no room
  waiting_text_ += job.line.size();
}

void DiskThreads::write_lines() {
  std::array<std::string, kTables> lines;
  {
    const std::lock_guard lock(mutex_);
    lines.swap(lines_);
    waiting_text_ = 0;
  }
  room_.notify_all();
  std::exception_ptr failure;
  for (std::size_t i = 0; i < kTables; ++i) {
    tables_[i]->append(lines[i]);
    const bool frames = i == static_cast<std::size_t>(RecordedTable::kFrameLines);
    try {
      tables_[i]->flush();
      frame_lines_written_ = frame_lines_written_ || frames;
    } catch (...) {  // the others' lines are written all the same
      frame_lines_written_ = frame_lines_written_ && !frames;
      if (!failure) failure = std::current_exception();
    }
  }
  if (failure) std::rethrow_exception(failure);
}

void DiskThreads::sync_loop() {
  ::pthread_setname_np(::pthread_self(), "disk-sync");
  std::unique_lock lock(mutex_);
  for (bool last = false; !last;) {
    last = sync_.wait_for(lock, kSyncPeriod, [this] { return written_out_; });
    lock.unlock();
    std::exception_ptr failure;
    try {
      sync_now(last);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    if (!failure || not_on_disk_) continue;
    not_on_disk_ = failure;
    if (!failure_) failure_ = failure;
    room_.notify_all();
  }
  synced_ = true;
  ended_.notify_all();
}

void DiskThreads::sync_now(bool last) {
  std::vector<std::shared_ptr<SpoolWriter>> segments;
  {
    const std::lock_guard lock(mutex_);
    segments = unsynced_;
    if (unsynced_.size() > 1) unsynced_.erase(unsynced_.begin(), unsynced_.end() - 1);
  }
  for (const auto& segment : segments) ++syncer_rounds_, sync_file(spool_folder(session_), segment->descriptor());
  for (std::size_t i = 0; i < kTables; ++i)
    ++syncer_rounds_, sync_file(session_ / kTableNames[i], tables_[i]->descriptor());
  ++syncer_rounds_;
  // What others put into the session: at its start, and beside what is recorded, as the wire's log.
  if (std::exchange(first_sync_, false) || last) file_system_.sync();
  ++syncer_rounds_;
  sync_folder(spool_folder(session_));
}

}  // namespace tankrig
