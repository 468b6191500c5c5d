// Who writes to a session: a recording holds its folder, so that nobody mends, or adds to, what is still growing.
#pragma once

#include <cstdint>
#include <filesystem>

namespace tankrig {

/// What is about to be done with a session. Who only reads shares it with other readers.
enum class SessionUse : std::uint8_t { kWrite, kRead };

/// An advisory lock on the session's folder; ends with the object, or with the process however it dies.
class SessionLock {
 public:
  /// Errors: InputError if another process, or another object, holds it.
  explicit SessionLock(const std::filesystem::path& session, SessionUse use = SessionUse::kWrite);
  ~SessionLock();
  SessionLock(const SessionLock&) = delete;
  SessionLock& operator=(const SessionLock&) = delete;

 private:
  int descriptor_ = -1;
};

}  // namespace tankrig
