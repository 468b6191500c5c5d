// A file descriptor that closes itself.
#pragma once

#include <unistd.h>

#include <atomic>

namespace tankrig {

class OwnedDescriptor {
 public:
  OwnedDescriptor() = default;
  explicit OwnedDescriptor(int fd) : fd_(fd) {}
  ~OwnedDescriptor() { reset(); }
  OwnedDescriptor(OwnedDescriptor&& other) noexcept : fd_(other.fd_.exchange(-1)) {}
  OwnedDescriptor& operator=(OwnedDescriptor&& other) noexcept {
    if (this != &other) {
      reset();
      fd_ = other.fd_.exchange(-1);
    }
    return *this;
  }

  /// Threads: any.
  int get() const noexcept { return fd_.load(std::memory_order_relaxed); }
  explicit operator bool() const noexcept { return get() >= 0; }
  void reset() noexcept {
    if (const int fd = fd_.exchange(-1); fd >= 0) ::close(fd);
  }

 private:
  std::atomic<int> fd_{-1};
};

}  // namespace tankrig
