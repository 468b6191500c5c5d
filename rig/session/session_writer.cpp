#include "rig/session/session_writer.hpp"

#include <cstdio>
#include <exception>

#include "core/input_error.hpp"
#include "core/utc.hpp"
#include "rig/session/session_tables.hpp"
#include "rig/session/session_yaml.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

constexpr Duration kFlushPeriod = std::chrono::seconds(1);

fs::path make_folder(fs::path path) {
  std::error_code failed;
  if (fs::exists(path, failed) && !fs::is_empty(path, failed))
    throw InputError(path, "exists already, expected the name of a new session");
  fs::create_directories(path, failed);
  if (failed) throw InputError(path, "cannot be created: " + failed.message());
  return path;
}

std::string numbered(int index) {
  char name[16];
  std::snprintf(name, sizeof name, "%06d.png", index);
  return name;
}

}  // namespace

SessionWriter::SessionWriter(fs::path path, SessionInfo info, SessionWriterOptions options)
    : path_(make_folder(std::move(path))),
      info_(std::move(info)),
      options_(options),
      images_(options.threads, options.queue_frames) {
  if (info_.name.empty()) info_.name = path_.filename().string();
  if (info_.status.empty()) info_.status = "recording";
  if (info_.kind.empty()) info_.kind = "scan";
  if (info_.created_utc.empty()) info_.created_utc = utc_now();
  joints_.emplace(path_ / "joints.csv");
  frames_.emplace(path_ / "frames.csv");
  events_.emplace(path_ / "events.csv");
  joints_->append(joints_header()), frames_->append(frames_header()), events_->append(events_header());
  joints_->flush(), frames_->flush(), events_->flush();
  write_whole_file(path_ / "session.yaml", session_yaml(info_));
}

SessionWriter::~SessionWriter() {
  try {
    close("stopped: not closed");
  } catch (...) {
    // An exception is on its way already, and the directory still says what it holds.
  }
}

void SessionWriter::flush_if_due(Stamp now) {
  if (!last_flush_) last_flush_ = now;
  if (now - *last_flush_ < kFlushPeriod) return;
  last_flush_ = now;
  joints_->flush(), frames_->flush(), events_->flush();
}

void SessionWriter::joints(const JointState& state) {
  joints_->append(joints_line(state));
  flush_if_due(state.stamp);
}

void SessionWriter::frame(const FrameRecord& frame, const cv::Mat& image) {
  FrameRecord record = frame;
  const fs::path folder = fs::path("frames") / record.camera;
  if (record.file.empty()) record.file = (folder / numbered(record.index)).generic_string();
  if (cameras_[record.camera]++ == 0) {
    std::error_code failed;
    fs::create_directories(path_ / folder, failed);
    if (failed) throw InputError(path_ / folder, "cannot be created: " + failed.message());
  }
  if (images_.push(path_ / record.file, image, options_.wait_when_full)) {
    frames_->append(frames_line(record));
  } else {
    ++info_.counts[kDroppedByDisk];
    event(record.stamp, "drop",
          record.camera + " frame " + std::to_string(record.index) + ": the disk had no time for it");
  }
  flush_if_due(record.stamp);
}

void SessionWriter::event(Stamp stamp, std::string_view kind, std::string_view text) {
  events_->append(events_line(stamp, kind, text));
  flush_if_due(stamp);
}

void SessionWriter::add_file(const fs::path& source, const std::string& name) { copy_whole_file(source, path_ / name); }

void SessionWriter::add_text(const std::string& name, std::string_view text) { write_whole_file(path_ / name, text); }

void SessionWriter::close(const std::string& status) {
  if (closed_) return;
  closed_ = true;
  std::exception_ptr failure;
  info_.status = status;
  try {
    images_.finish();
  } catch (const std::exception& e) {
    failure = std::current_exception();
    info_.status = std::string("stopped: ") + e.what();
  }
  joints_->flush(), frames_->flush(), events_->flush();
  write_whole_file(path_ / "session.yaml", session_yaml(info_));
  if (failure) std::rethrow_exception(failure);
}

}  // namespace tankrig
