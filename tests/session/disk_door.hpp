// The program's own way to the disk: what has passed its syncs survives a power cut, and a test may shut them, or let
// any one step fail.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace tankrig::testing_support {

/// While it lives, calls below `folder` are noted, and may be held up or refused. One at a time.
/// Threads: any.
class DiskDoor {
 public:
  /// A step is a call of open for writing or of a folder, write, writev, rename, fsync, fdatasync or syncfs.
  enum class Fails { kNever, kOnce, kFromThenOn };

  explicit DiskDoor(const std::filesystem::path& folder);
  ~DiskDoor();
  DiskDoor(const DiskDoor&) = delete;
  DiskDoor& operator=(const DiskDoor&) = delete;

  /// Syncs do not return until they are let go.
  void hold();
  void let_go();
  bool someone_waits() const;
  /// Syncs fail with this error; 0: they do not.
  void refuse(int error);

  /// The step of this number, from 0, fails with this error.
  void fail(int step, int error, Fails how);
  /// The call that failed, and the name of its file; empty if none has.
  std::string failed() const;

  /// The files below `folder` that a power cut would leave now, and what they hold: what their last sync found, under
  /// the names that the last sync of their folder found.
  std::map<std::string, std::string> on_disk(const std::filesystem::path& folder) const;
};

/// A copy of `session` at `cut`, as a power cut would leave it now.
void leave_on_disk(const DiskDoor& door, const std::filesystem::path& session, const std::filesystem::path& cut);

}  // namespace tankrig::testing_support
