// The recorder: a session directory written while the scan runs.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "core/joint_state.hpp"
#include "session/reading/session.hpp"
#include "session/recording/disk_threads.hpp"
#include "session/recording/session_lock.hpp"
#include "session/recording/spool_pictures.hpp"

namespace tankrig {

struct SessionWriterOptions {
  bool wait_when_full =
      true;  ///< virtual clock: wait for the disk. Real clock: false, the frame is dropped and counted
  std::size_t ring_bytes = 256 << 20;  ///< frames that may wait for the disk: seconds of two 1.3-megapixel cameras
  DiskPatience patience = {};
};

/// From the first moment the directory opens as a session: status "recording", growing tables, frames in the spool
/// (session/recording/spool.hpp). close() makes pictures of the frames. A kill, a full disk or a power cut loses at
/// most the last second (session/recording/disk_threads.hpp); `tankrig session recover` makes the rest whole.
/// Threads: one; the disk has its own, and unless `wait_when_full` nothing here waits for it before close().
/// Errors: InputError naming the file, from the call that finds the failure or the next one. Never silently.
class SessionWriter {
 public:
  /// Reasons in `counts`, after "CAMERA.": the ring was full, or the disk refused.
  static constexpr const char* kDroppedByRing = "dropped_ring";
  static constexpr const char* kDroppedByDisk = "dropped_disk";

  /// Creates `path` and its parents. It must not exist, or be empty. An empty status becomes "recording", an empty
  /// created_utc becomes now.
  SessionWriter(std::filesystem::path path, SessionInfo info, SessionWriterOptions options = {});
  /// If not closed (an exception is being thrown): closes with "stopped: not closed" as well as it can.
  ~SessionWriter();
  SessionWriter(const SessionWriter&) = delete;
  SessionWriter& operator=(const SessionWriter&) = delete;

  void joints(const JointState& state);
  /// Records the frame and its image. An empty `frame.file` becomes frames/<camera>/<index>.png. The image is shared
  /// with the writing thread: nobody may write to it afterwards.
  void frame(const FrameRecord& frame, const cv::Mat& image);
  void event(Stamp stamp, std::string_view kind, std::string_view text);

  /// Puts a copy of a file, or a text, into the session under `name`.
  void add_file(const std::filesystem::path& source, const std::string& name);
  void add_text(const std::string& name, std::string_view text);

  /// What close() writes to session.yaml. The writer fills in "CAMERA.recorded", the counts of dropped frames and the
  /// unaccounted ones.
  SessionInfo& info() { return info_; }
  const std::filesystem::path& path() const { return path_; }

  /// Writes everything out, the final session.yaml, and the pictures. `status`: "complete" or "stopped: REASON". If
  /// something could not be written, the status says that instead. Its error is thrown when the rest is safe; after
  /// NotOnDisk the spool is kept. If `pictures.stop` ends it early, Session::open warns of the frames left in the
  /// spool.
  /// Errors: as above, and DiskHangs: nothing more is written, and the status on the disk stays "recording".
  void close(const std::string& status, const PictureOptions& pictures = {});

 private:
  void take_counts();

  std::filesystem::path path_;
  std::shared_ptr<SessionLock> lock_;
  SessionInfo info_;
  std::shared_ptr<DiskThreads> disk_;
  bool closed_ = false;
};

}  // namespace tankrig
