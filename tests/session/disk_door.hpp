// The program's own fdatasync, fsync and syncfs: what has passed them survives a power cut, and a test may shut them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

namespace tankrig::testing_support {

/// While it lives, calls are noted, and may be held up or refused. One at a time.  Threads: any.
class DiskDoor {
 public:
  DiskDoor();
  ~DiskDoor();
  DiskDoor(const DiskDoor&) = delete;
  DiskDoor& operator=(const DiskDoor&) = delete;

  /// Calls do not return until they are let go.
  void hold();
  void let_go();
  bool someone_waits() const;
  /// Calls fail with this error; 0: they do not.
  void refuse(int error);

  /// The files below `folder` that a power cut would leave now, and how many bytes of each: what its last sync found,
  /// if its name was on the disk by then.
  std::map<std::string, std::uint64_t> on_disk(const std::filesystem::path& folder) const;
};

}  // namespace tankrig::testing_support
