#include "drivers/serial/serial_port.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>

#include "core/clock.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

Error failure(ErrorCode code, int os_errno, const char* where) noexcept {
  return {code, os_errno, MonotonicClock{}.now(), where};
}

std::string why_not_opened(const std::string& device, int error) {
  switch (error) {
    case ENOENT:
      return device + " does not exist: plug the adapter in and see its name with dmesg, or correct `device`";
    case EACCES:
    case EPERM:
      return device +
             " may not be opened: add the user to the group dialout (sudo usermod -aG dialout $USER) and "
             "log in again";
    case EBUSY:
    case EWOULDBLOCK:
      return device + " is in use by another program: see which with `fuser -v " + device + "` and end it";
    case ENXIO:
    case ENODEV:
    case EIO:
      return device + " has no device behind it: plug the adapter in, or start its emulator";
    case ENOTTY:
      return device + " is not a terminal: expected a serial line such as /dev/ttyUSB0";
    default:
      return device + " cannot be opened: " + std::strerror(error);
  }
}

}  // namespace

struct SerialPort::Impl {
  SerialSettings settings;
  const int nowhere = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  const int fd = ::fcntl(nowhere, F_DUPFD_CLOEXEC, 0);  // the line, else nowhere; write_regardless() knows no other
  bool is_open = false;                                 // the line is there, locked, non-blocking
  bool hung_up = false;                                 // closed by reopen(), which may wait
  const bool taken = false;                             // another process's
  std::optional<termios> as_taken{};                    // its settings

  ~Impl() {
    close();
    ::close(fd);
    ::close(nowhere);
  }

  void close() noexcept {
    if (!is_open) return;
    if (!taken) ::ioctl(fd, TIOCNXCL);
    ::dup3(nowhere, fd, O_CLOEXEC);
    is_open = hung_up = false;
  }

  Error lost(int os_errno, const char* where) noexcept {
    hung_up = true;
    return failure(ErrorCode::kDisconnected, os_errno, where);
  }

  bool connected() const noexcept { return is_open && !hung_up; }

  /// 0, or the errno that says why the line is not ours. The lock comes before the settings, which are another's else.
  int claim() {
    const int line = ::open(settings.device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (line < 0) return errno;
    is_open = ::dup3(line, fd, O_CLOEXEC) == fd;
    const int error = errno;
    ::close(line);
    if (!is_open) return error;
    if (!::isatty(fd)) return errno == EIO ? EIO : ENOTTY;
    if (::flock(fd, LOCK_EX | LOCK_NB) != 0) return errno;
    if (const int gone = set_line()) return gone;
    ::ioctl(fd, is_pseudo_terminal(fd) ? TIOCNXCL : TIOCEXCL);  // an emulator's end would keep it closed for ever
    ::tcflush(fd, TCIOFLUSH);
    if (settings.opened) settings.opened(fd);
    return 0;
  }

  int set_line() const {
    if (!taken) return set_serial_line(fd, settings);
    if (!as_taken) return ENODEV;
    return ::tcsetattr(fd, TCSANOW, &*as_taken) == 0 ? 0 : errno;
  }
};

SerialPort::SerialPort(const SerialSettings& settings) : impl_(std::make_unique<Impl>()) {
  check_serial_settings(settings);
  impl_->settings = settings;
  if (const int error = impl_->claim()) throw InputError(why_not_opened(settings.device, error));
}

SerialPort::SerialPort(const SerialSettings& settings, int line)
    : impl_(new Impl{.settings = settings, .taken = true}) {
  take(line);
}

SerialPort::~SerialPort() = default;
SerialPort::SerialPort(SerialPort&&) noexcept = default;
SerialPort& SerialPort::operator=(SerialPort&&) noexcept = default;

Result<std::size_t> SerialPort::try_read(std::span<std::uint8_t> into) noexcept {
  constexpr const char* kWhere = "serial line: read";
  if (!impl_->connected()) return failure(ErrorCode::kDisconnected, 0, kWhere);
  if (into.empty()) return std::size_t{0};
  const ssize_t n = ::read(impl_->fd, into.data(), into.size());
  if (n > 0) return static_cast<std::size_t>(n);
  if (n < 0 && (errno == EAGAIN || errno == EINTR)) return std::size_t{0};
  if (n < 0) return impl_->lost(errno, kWhere);
  // With VMIN 0 an idle line reads 0 as well: only a hang-up is the end.
  pollfd waiting{impl_->fd, POLLIN, 0};
  if (::poll(&waiting, 1, 0) == 1 && (waiting.revents & (POLLHUP | POLLERR | POLLNVAL))) return impl_->lost(0, kWhere);
  return std::size_t{0};
}

Result<std::size_t> SerialPort::try_write(std::span<const std::uint8_t> bytes) noexcept {
  constexpr const char* kWhere = "serial line: write";
  if (!impl_->connected()) return failure(ErrorCode::kDisconnected, 0, kWhere);
  if (bytes.empty()) return std::size_t{0};
  const ssize_t n = ::write(impl_->fd, bytes.data(), bytes.size());
  if (n >= 0) return static_cast<std::size_t>(n);
  if (errno == EAGAIN || errno == EINTR) return std::size_t{0};
  return impl_->lost(errno, kWhere);
}

void SerialPort::write_regardless(std::span<const std::uint8_t> bytes) const noexcept {
  [[maybe_unused]] const ssize_t written = ::write(impl_->fd, bytes.data(), bytes.size());
}

Status SerialPort::discard_input() noexcept {
  constexpr const char* kWhere = "serial line: discard input";
  if (!impl_->connected()) return failure(ErrorCode::kDisconnected, 0, kWhere);
  if (::tcflush(impl_->fd, TCIFLUSH) != 0) return impl_->lost(errno, kWhere);
  return {};
}

Status SerialPort::wait_readable(Duration timeout) noexcept {
  constexpr const char* kWhere = "serial line: wait";
  if (!impl_->connected()) return failure(ErrorCode::kDisconnected, 0, kWhere);
  const MonotonicClock clock;
  const Stamp deadline = clock.now() + std::max(timeout, Duration{0});
  for (;;) {
    const Duration left = std::max(deadline - clock.now(), Duration{0});
    const timespec wait{left.count() / 1'000'000'000, left.count() % 1'000'000'000};
    pollfd waiting{impl_->fd, POLLIN, 0};
    const int ready = ::ppoll(&waiting, 1, &wait, nullptr);
    if (ready > 0 && waiting.revents == POLLIN) return {};
    if (ready > 0) return impl_->lost(0, kWhere);
    if (ready < 0 && errno != EINTR) return impl_->lost(errno, kWhere);
    if (ready == 0) return failure(ErrorCode::kTimeout, 0, kWhere);
  }
}

Status SerialPort::reopen() noexcept {
  constexpr const char* kWhere = "serial line: open again";
  if (impl_->is_open) ::flock(impl_->fd, LOCK_UN);  // a copy in another process would keep it locked
  impl_->close();
  int error = 0;
  try {
    error = impl_->claim();
    if (error == 0) return {};
  } catch (const InputError&) {  // it does not take its settings
  }
  impl_->close();
  return failure(ErrorCode::kNotReady, error, kWhere);
}

void SerialPort::take(int line) noexcept {
  impl_->close();
  if (line < 0) return;
  impl_->is_open = ::dup3(line, impl_->fd, O_CLOEXEC) == impl_->fd;
  termios chosen{};
  if (impl_->is_open && ::tcgetattr(impl_->fd, &chosen) == 0) impl_->as_taken = chosen;
}

int SerialPort::descriptor() const noexcept { return impl_->connected() ? impl_->fd : -1; }
const SerialSettings& SerialPort::settings() const noexcept { return impl_->settings; }

}  // namespace tankrig
