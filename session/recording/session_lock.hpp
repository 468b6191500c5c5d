// Who writes to a session: a recording holds its folder, so that nobody mends, or adds to, what is still growing.
#pragma once

#include <cstdint>
#include <filesystem>

#include "core/time.hpp"

namespace tankrig {

/// What is about to be done with a session. Who only reads shares it with other readers.
enum class SessionUse : std::uint8_t { kWrite, kRead };

/// An advisory lock on the session's folder; ends with the object, or with the process however it dies.
class SessionLock {
 public:
  /// Waits for another process, or another object, that holds it: who only has a look ends nobody's work.
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
