// Who may write to a session: a recording locks its folder, so that nobody mends or extends a growing session.
#pragma once

#include <cstdint>
#include <filesystem>

#include "core/time.hpp"

namespace tankrig {

/// What a command does with a session. Readers share it with other readers.
enum class SessionUse : std::uint8_t { kWrite, kRead };

/// An advisory lock on the session's folder. It ends with the object, or with the process however it dies.
class SessionLock {
 public:
  /// Waits while another process or object holds it, so a short look does not end anybody's work.
  /// Errors: InputError if it is still held after `patience`.
  explicit SessionLock(const std::filesystem::path& session, SessionUse use = SessionUse::kWrite,
                       Duration patience = std::chrono::seconds(2));
  ~SessionLock();
  SessionLock(const SessionLock&) = delete;
  SessionLock& operator=(const SessionLock&) = delete;

 private:
  int descriptor_ = -1;
};

}  // namespace tankrig
