#include "session/recording/session_writer.hpp"

#include <fmt/core.h>

#include <exception>

#include "core/input_error.hpp"
#include "core/text_files.hpp"
#include "core/utc.hpp"
#include "session/reading/session_tables.hpp"
#include "session/reading/session_yaml.hpp"
#include "session/recording/event_kinds.hpp"
#include "session/recording/spool.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

fs::path make_folder(fs::path path) {
  std::error_code failed;
  if (fs::exists(path, failed) && !fs::is_empty(path, failed))
    throw InputError(path, "exists already, expected the name of a new session");
  fs::create_directories(path, failed);
  if (failed) throw InputError(path, "cannot be created: " + failed.message());
  return path;
}

SessionInfo beginning(SessionInfo info, const fs::path& path) {
  if (info.name.empty()) info.name = (path.has_filename() ? path : path.parent_path()).filename().string();
  if (info.status.empty()) info.status = "recording";
  if (info.kind.empty()) info.kind = "scan";
  if (info.created_utc.empty()) info.created_utc = utc_now();
  return info;
}

void count(TableSpan& span, Stamp stamp) {
  if (span.lines++ == 0) span.first = stamp;
  span.last = stamp;
}

}  // namespace

SessionWriter::SessionWriter(fs::path path, SessionInfo info, SessionWriterOptions options)
    : path_(make_folder(std::move(path))),
      lock_(std::make_shared<SessionLock>(path_)),
      info_(beginning(std::move(info), path_)) {
  write_file_durably(path_ / "session.yaml", session_yaml(info_));
  disk_ = DiskThreads::start(path_, lock_, options.ring_bytes, options.wait_when_full, options.patience);
}

SessionWriter::~SessionWriter() {
  try {
    close("stopped: not closed");
  } catch (...) {
    // An exception is on its way already, and the directory still says what it holds.
  }
}

void SessionWriter::joints(const JointState& state) {
  if (disk_->add_line(RecordedTable::kJointLines, joints_line(state)))
    count(info_.tables["joints"], state.stamp);
  else
    ++info_.counts[std::string("joints.") + kDroppedByRing];
}

void SessionWriter::frame(const FrameRecord& frame, const cv::Mat& image) {
  FrameRecord record = frame;
  if (record.file.empty()) record.file = picture_name(record);
  if (disk_->add_frame(record.camera, frames_line(record), image)) {
    count(info_.tables["frames"], record.stamp);
  } else {
    ++info_.counts[record.camera + "." + kDroppedByRing];
    event(record.stamp, event_kind::kDrop,
          fmt::format("{} frame {}: the disk had no time for it", record.camera, record.index));
  }
}

void SessionWriter::event(Stamp stamp, std::string_view kind, std::string_view text) {
  if (disk_->add_line(RecordedTable::kEventLines, events_line(stamp, kind, text)))
    count(info_.tables["events"], stamp);
  else
    ++info_.counts[std::string("events.") + kDroppedByRing];
}

void SessionWriter::add_file(const fs::path& source, const std::string& name) {
  add_text(name, read_whole_file(source));
}

void SessionWriter::add_text(const std::string& name, std::string_view text) { write_file_durably(path_ / name, text); }

void SessionWriter::take_counts() {
  std::uint64_t on_disk = 0;
  for (const CalibratedCamera& camera : info_.cameras) info_.counts[camera.name + ".recorded"] = 0;
  for (const auto& [camera, n] : disk_->written()) info_.counts[camera + ".recorded"] = n, on_disk += n;
  for (const auto& [camera, n] : disk_->refused()) info_.counts[camera + "." + kDroppedByDisk] += n;
  info_.tables["frames"].lines = on_disk;
  for (auto& [camera, account] : info_.account)
    account.unaccounted = unaccounted(info_.counts, camera, account.expected);
}

void SessionWriter::close(const std::string& status, const PictureOptions& pictures) {
  if (closed_) return;
  closed_ = true;
  std::exception_ptr failure;
  bool on_disk = true;
  info_.status = status;
  const auto attempt = [&](const auto& step) {
    const auto fails = [&](const std::exception& e) {
      if (failure) return;
      failure = std::current_exception();
      info_.status = std::string("stopped: ") + e.what();
    };
    try {
      step();
    } catch (const DiskHangs&) {
      throw;
    } catch (const NotOnDisk& e) {
      on_disk = false;
      fails(e);
    } catch (const std::exception& e) {
      fails(e);
    }
  };
  std::string told;
  const auto tell = [&] {
    write_file_durably(path_ / "session.yaml", session_yaml(info_));
    told = info_.status;
  };
  attempt([&] { disk_->finish(); });
  take_counts();
  attempt(tell);
  if (on_disk && disk_->frame_lines_written()) attempt([&] { write_spooled_pictures(path_, pictures); });
  if (told != info_.status) attempt(tell);
  if (failure) std::rethrow_exception(failure);
}

}  // namespace tankrig
