#include "session/recording/session_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>

#include "core/clock.hpp"
#include "core/input_error.hpp"

namespace tankrig {

SessionLock::SessionLock(const std::filesystem::path& session, SessionUse use, Duration patience) {
  descriptor_ = ::open(session.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor_ < 0 && (errno == ENOENT || errno == ENOTDIR))
    throw InputError(session, "is not a folder, expected a session");
  if (descriptor_ < 0) throw InputError(session, std::string("cannot be opened: ") + std::strerror(errno));
  const int kind = use == SessionUse::kWrite ? LOCK_EX : LOCK_SH;
  MonotonicClock clock;
  for (const Stamp end = clock.now() + patience;;) {
    if (::flock(descriptor_, kind | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;  // or no locks on this file system
    if (clock.now() >= end) break;
    clock.sleep_until(clock.now() + std::chrono::milliseconds(20));
  }
  ::close(descriptor_);
  throw InputError(session, std::string("is being written ") + (use == SessionUse::kWrite ? "or read " : "") +
                                "by another process, expected a session at rest");
}

SessionLock::~SessionLock() { ::close(descriptor_); }

}  // namespace tankrig
