// Temporary folders in memory: for tests that write many small files and whose point is not the disk.
#pragma once

#include <unistd.h>

#include <cstdlib>
#include <string>

namespace tankrig {

/// While it lives, a TemporaryFolder is made in memory, where the system has such a place.
class InMemory {
 public:
  InMemory() {
    if (const char* before = std::getenv("TMPDIR")) before_ = before;
    if (::access("/dev/shm", W_OK) == 0) ::setenv("TMPDIR", "/dev/shm", 1);
  }
  ~InMemory() { before_.empty() ? ::unsetenv("TMPDIR") : ::setenv("TMPDIR", before_.c_str(), 1); }
  InMemory(const InMemory&) = delete;
  InMemory& operator=(const InMemory&) = delete;

 private:
  std::string before_;
};

}  // namespace tankrig
