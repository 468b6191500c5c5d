#include "sim_backends/wire/pty.hpp"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "core/clock.hpp"
#include "core/input_error.hpp"

namespace tankrig::sim {
namespace {

void make_raw(int fd) {
  termios settings{};
  if (::tcgetattr(fd, &settings) != 0) return;
  ::cfmakeraw(&settings);
  settings.c_cc[VMIN] = 0;
  ::tcsetattr(fd, TCSANOW, &settings);
}

/// Replaces whatever link stands there in one step, so that nobody ever finds the name missing.
void link_to(const std::string& target, const std::filesystem::path& name) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_status there = fs::symlink_status(name, error);
  if (fs::exists(there) && !fs::is_symlink(there))
    throw InputError(name, "exists and is no link, expected a free name for an emulated serial line");
  if (name.has_parent_path()) fs::create_directories(name.parent_path(), error);
  fs::path fresh = name;
  fresh += ".new-" + std::to_string(::getpid());
  fs::remove(fresh, error);
  fs::create_symlink(target, fresh, error);
  if (!error) fs::rename(fresh, name, error);
  if (error) throw InputError(name, "emulated serial line cannot be linked: " + error.message());
}

}  // namespace

Pty::Pty(std::filesystem::path name) : name_(std::move(name)) {
  try {
    plug();
  } catch (...) {
    unplug();
    throw;
  }
}

Pty::~Pty() { unplug(); }

void Pty::plug() {
  if (master_ >= 0) return;
  master_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
  std::array<char, 64> slave{};
  if (master_ < 0 || ::grantpt(master_) != 0 || ::unlockpt(master_) != 0 ||
      ::ptsname_r(master_, slave.data(), slave.size()) != 0 ||
      (keeper_ = ::open(slave.data(), O_RDWR | O_NOCTTY | O_CLOEXEC)) < 0)
    throw InputError(name_,
                     std::string("no pseudo-terminal: ") + std::strerror(errno) + ", expected a mounted /dev/pts");
  make_raw(keeper_);
  link_to(slave.data(), name_);
}

void Pty::unplug() noexcept {
  std::error_code ignored;
  std::array<char, 64> slave{};
  // Only our own link: another emulator may have taken the name over.
  if (master_ >= 0 && ::ptsname_r(master_, slave.data(), slave.size()) == 0 &&
      std::filesystem::read_symlink(name_, ignored) == slave.data())
    std::filesystem::remove(name_, ignored);
  if (keeper_ >= 0) ::close(std::exchange(keeper_, -1));
  if (master_ >= 0) ::close(std::exchange(master_, -1));
}

Result<std::size_t> Pty::try_read(std::span<std::uint8_t> into) noexcept {
  const auto failed = [](ErrorCode code, int error) {
    return Error{code, error, MonotonicClock{}.now(), "emulated serial line: read"};
  };
  if (master_ < 0) return failed(ErrorCode::kDisconnected, 0);
  const ssize_t n = ::read(master_, into.data(), into.size());
  if (n >= 0) return static_cast<std::size_t>(n);
  if (errno == EAGAIN || errno == EINTR || errno == EIO) return std::size_t{0};
  return failed(ErrorCode::kIo, errno);
}

Result<std::size_t> Pty::try_write(std::span<const std::uint8_t> bytes) noexcept {
  const auto failed = [](ErrorCode code, int error) {
    return Error{code, error, MonotonicClock{}.now(), "emulated serial line: write"};
  };
  if (master_ < 0) return failed(ErrorCode::kDisconnected, 0);
  const ssize_t n = ::write(master_, bytes.data(), bytes.size());
  if (n >= 0) return static_cast<std::size_t>(n);
  if (errno == EAGAIN || errno == EINTR || errno == EIO) return std::size_t{0};
  return failed(ErrorCode::kIo, errno);
}

}  // namespace tankrig::sim
