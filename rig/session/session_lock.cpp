#include "rig/session/session_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/input_error.hpp"

namespace tankrig {

SessionLock::SessionLock(const std::filesystem::path& session) {
  descriptor_ = ::open(session.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor_ < 0) throw InputError(session, std::string("cannot be opened: ") + std::strerror(errno));
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;  // or no locks on this file system
  ::close(descriptor_);
  throw InputError(session, "is being written by another process, expected a session at rest");
}

SessionLock::~SessionLock() { ::close(descriptor_); }

}  // namespace tankrig
