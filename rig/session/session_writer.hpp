// The recorder: a session directory written while the scan runs.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/arm/arm.hpp"
#include "rig/session/image_queue.hpp"
#include "rig/session/session.hpp"
#include "rig/session/text_files.hpp"

namespace tankrig {

struct SessionWriterOptions {
  bool wait_when_full =
      true;               ///< virtual clock: wait for the disk. Real clock: false, the frame is dropped and counted
  int queue_frames = 32;  ///< frames that may wait for the disk
  int threads = 2;        ///< threads that compress
};

/// From its first moment the directory is a session that opens: status "recording", tables that grow and are flushed
/// once a second of the run, images that appear whole. What a kill loses is at most that last second.
/// Threads: one (images are compressed in its own).
/// Errors: InputError naming the file, from the call that finds it or the next one. Never silently.
class SessionWriter {
 public:
  /// Reason in `counts` of a frame that the disk had no time for.
  static constexpr const char* kDroppedByDisk = "dropped_disk";

  /// Creates `path` (and its parents), which must not exist or be empty. Status, if empty, becomes "recording" and
  /// created_utc, if empty, now.
  SessionWriter(std::filesystem::path path, SessionInfo info, SessionWriterOptions options = {});
  /// Not closed (an exception is on its way): closes with "stopped: not closed" as well as it can.
  ~SessionWriter();
  SessionWriter(const SessionWriter&) = delete;
  SessionWriter& operator=(const SessionWriter&) = delete;

  void joints(const JointState& state);
  /// Records the frame and its image. An empty `frame.file` becomes frames/<camera>/<index>.png. The image is shared
  /// with the compressing threads: nobody writes to it afterwards.
  void frame(const FrameRecord& frame, const cv::Mat& image);
  void event(Stamp stamp, std::string_view kind, std::string_view text);

  /// Puts a copy of a file, or a text, into the session under `name`.
  void add_file(const std::filesystem::path& source, const std::string& name);
  void add_text(const std::string& name, std::string_view text);

  /// What session.yaml says at close(); counts of dropped frames are added by the writer.
  SessionInfo& info() { return info_; }
  const std::filesystem::path& path() const { return path_; }

  /// Writes everything out and the final session.yaml. `status`: "complete" or "stopped: REASON". If an image could not
  /// be written, the status says that instead, and its error is thrown when the rest is safe.
  void close(const std::string& status);

 private:
  void flush_if_due(Stamp now);

  std::filesystem::path path_;
  SessionInfo info_;
  SessionWriterOptions options_;
  std::optional<AppendFile> joints_, frames_, events_;
  std::map<std::string, int> cameras_;
  std::optional<Stamp> last_flush_;
  ImageQueue images_;
  bool closed_ = false;
};

}  // namespace tankrig
