// Who writes to a session: a recording holds its folder, so that nobody mends what is still growing.
#pragma once

#include <filesystem>

namespace tankrig {

/// An advisory lock on the session's folder; ends with the object, or with the process however it dies.
class SessionLock {
 public:
  /// Errors: InputError if another process, or another object, holds it.
  explicit SessionLock(const std::filesystem::path& session);
  ~SessionLock();
  SessionLock(const SessionLock&) = delete;
  SessionLock& operator=(const SessionLock&) = delete;

 private:
  int descriptor_ = -1;
};

}  // namespace tankrig
