#include "drivers/camera/v4l2_device.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "core/clock.hpp"

namespace tankrig {
namespace {

class KernelV4l2Device final : public V4l2Device {
 public:
  KernelV4l2Device() = default;
  ~KernelV4l2Device() override { close(); }
  KernelV4l2Device(const KernelV4l2Device&) = delete;
  KernelV4l2Device& operator=(const KernelV4l2Device&) = delete;

  int open(const std::string& path) noexcept override {
    close();
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0) return errno;
    if (!S_ISCHR(status.st_mode)) return ENOTTY;
    fd_ = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    return fd_ < 0 ? errno : 0;
  }

  void close() noexcept override {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }

  int call(unsigned long request, void* argument) noexcept override {
    int result = 0;
    do result = ::ioctl(fd_, request, argument);
    while (result < 0 && errno == EINTR);
    return result < 0 ? errno : 0;
  }

  std::uint8_t* map(std::size_t length, std::int64_t offset) noexcept override {
    void* memory = ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, offset);
    return memory == MAP_FAILED ? nullptr : static_cast<std::uint8_t*>(memory);
  }

  void unmap(std::uint8_t* memory, std::size_t length) noexcept override { ::munmap(memory, length); }

  short wait(short events, Duration timeout) noexcept override {
    pollfd entry{fd_, events, 0};
    const auto ms = std::chrono::ceil<std::chrono::milliseconds>(std::max(timeout, Duration{0})).count();
    return ::poll(&entry, 1, static_cast<int>(ms)) > 0 ? entry.revents : short{0};
  }

  int write(const std::uint8_t* bytes, std::size_t size) noexcept override {
    const ssize_t written = ::write(fd_, bytes, size);
    if (written < 0) return errno;
    return static_cast<std::size_t>(written) == size ? 0 : EIO;
  }

  Stamp now() const noexcept override { return MonotonicClock().now(); }

 private:
  int fd_ = -1;
};

}  // namespace

std::unique_ptr<V4l2Device> kernel_v4l2_device() { return std::make_unique<KernelV4l2Device>(); }

}  // namespace tankrig
