#include "drivers/serial/serial_port.hpp"

#include <fcntl.h>
#include <libserial/SerialPort.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include "core/clock.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

using LibSerial::BaudRate;

constexpr std::array<std::pair<int, BaudRate>, 26> kBauds{
    {{300, BaudRate::BAUD_300},         {600, BaudRate::BAUD_600},         {1200, BaudRate::BAUD_1200},
     {1800, BaudRate::BAUD_1800},       {2400, BaudRate::BAUD_2400},       {4800, BaudRate::BAUD_4800},
     {9600, BaudRate::BAUD_9600},       {19200, BaudRate::BAUD_19200},     {38400, BaudRate::BAUD_38400},
     {57600, BaudRate::BAUD_57600},     {115200, BaudRate::BAUD_115200},   {230400, BaudRate::BAUD_230400},
     {460800, BaudRate::BAUD_460800},   {500000, BaudRate::BAUD_500000},   {576000, BaudRate::BAUD_576000},
     {921600, BaudRate::BAUD_921600},   {1000000, BaudRate::BAUD_1000000}, {1152000, BaudRate::BAUD_1152000},
     {1500000, BaudRate::BAUD_1500000}, {2000000, BaudRate::BAUD_2000000}, {2500000, BaudRate::BAUD_2500000},
     {3000000, BaudRate::BAUD_3000000}, {3500000, BaudRate::BAUD_3500000}, {4000000, BaudRate::BAUD_4000000},
     {50, BaudRate::BAUD_50},           {110, BaudRate::BAUD_110}}};

Error failure(ErrorCode code, int os_errno, const char* where) noexcept {
  return {code, os_errno, MonotonicClock{}.now(), where};
}

std::optional<BaudRate> known_baud(int baud) {
  for (const auto& [rate, code] : kBauds)
    if (rate == baud) return code;
  return std::nullopt;
}

/// libserial's destructor throws, and so ends the program, if the device went while it was open.
struct CloseOrAbandon {
  void operator()(LibSerial::SerialPort* line) const noexcept {
    try {
      if (line->IsOpen()) line->Close();
    } catch (...) {
      try {
        ::close(line->GetFileDescriptor());
      } catch (...) {
      }
      return;  // not deleted
    }
    delete line;
  }
};

/// It carries whole bytes whatever the settings, and its emulator holds it open, so that exclusive use would never end.
bool is_pseudo_terminal(int fd) {
  struct stat status {};
  if (::fstat(fd, &status) != 0) return false;
  const unsigned major_number = major(status.st_rdev);
  return major_number >= 136 && major_number <= 143;
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

  ~Impl() {
    close();
    ::close(fd);
    ::close(nowhere);
  }

  void close() noexcept {
    if (!is_open) return;
    ::ioctl(fd, TIOCNXCL);
    ::dup3(nowhere, fd, O_CLOEXEC);
    is_open = hung_up = false;
  }

  Error lost(int os_errno, const char* where) noexcept {
    hung_up = true;
    return failure(ErrorCode::kDisconnected, os_errno, where);
  }

  bool connected() const noexcept { return is_open && !hung_up; }

  /// 0, or the errno that says why the line is not ours.
  int claim() noexcept {
    const int line = ::open(settings.device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (line < 0) return errno;
    is_open = ::dup3(line, fd, O_CLOEXEC) == fd;
    const int error = errno;
    ::close(line);
    if (!is_open) return error;
    if (!::isatty(fd)) return errno == EIO ? EIO : ENOTTY;
    return ::flock(fd, LOCK_EX | LOCK_NB) == 0 ? 0 : errno;
  }

  void configure() {
    using namespace LibSerial;
    const bool pseudo = is_pseudo_terminal(fd);
    const auto baud = known_baud(settings.baud);
    const std::unique_ptr<LibSerial::SerialPort, CloseOrAbandon> line(new LibSerial::SerialPort);
    line->Open(settings.device);
    ::fcntl(line->GetFileDescriptor(), F_SETFD, FD_CLOEXEC);
    line->SetBaudRate(*baud);
    line->SetFlowControl(FlowControl::FLOW_CONTROL_NONE);
    line->SetStopBits(settings.stop_bits == 2 ? StopBits::STOP_BITS_2 : StopBits::STOP_BITS_1);
    if (!pseudo) {
      constexpr CharacterSize kSizes[] = {CharacterSize::CHAR_SIZE_5, CharacterSize::CHAR_SIZE_6,
                                          CharacterSize::CHAR_SIZE_7, CharacterSize::CHAR_SIZE_8};
      line->SetCharacterSize(kSizes[settings.data_bits - 5]);
      line->SetParity(settings.parity == 'E'   ? Parity::PARITY_EVEN
                      : settings.parity == 'O' ? Parity::PARITY_ODD
                                               : Parity::PARITY_NONE);
    }
    termios chosen{};
    if (::tcgetattr(fd, &chosen) != 0) throw InputError(why_not_opened(settings.device, errno));
    chosen.c_iflag = settings.parity != 'N' && !pseudo ? INPCK : 0;  // a byte with a parity error is read as 0
    chosen.c_oflag = 0;
    chosen.c_lflag = 0;
    chosen.c_cc[VMIN] = 0;
    chosen.c_cc[VTIME] = 0;
    line->Close();  // restores what it found
    termios granted{};
    if (::tcsetattr(fd, TCSANOW, &chosen) != 0 || ::tcgetattr(fd, &granted) != 0)
      throw InputError(why_not_opened(settings.device, errno));
    if (::cfgetospeed(&granted) != static_cast<speed_t>(*baud))
      throw InputError(settings.device + " does not know " + std::to_string(settings.baud) +
                       " baud: expected a rate that adapter and device share");
    ::ioctl(fd, pseudo ? TIOCNXCL : TIOCEXCL);
    ::tcflush(fd, TCIOFLUSH);
  }
};

SerialPort::SerialPort(const SerialSettings& settings) : impl_(std::make_unique<Impl>()) {
  impl_->settings = settings;
  const std::string& device = settings.device;
  if (!known_baud(settings.baud))
    throw InputError(device + ": baud is " + std::to_string(settings.baud) +
                     ", expected a standard rate, e.g. 9600 or 115200");
  if (settings.data_bits < 5 || settings.data_bits > 8)
    throw InputError(device + ": data bits are " + std::to_string(settings.data_bits) + ", expected 5 to 8");
  if (settings.parity != 'N' && settings.parity != 'E' && settings.parity != 'O')
    throw InputError(device + ": parity is '" + std::string(1, settings.parity) + "', expected N, E or O");
  if (settings.stop_bits < 1 || settings.stop_bits > 2)
    throw InputError(device + ": stop bits are " + std::to_string(settings.stop_bits) + ", expected 1 or 2");
  if (const int error = impl_->claim()) throw InputError(why_not_opened(device, error));
  try {
    impl_->configure();
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& e) {
    throw InputError(device + " cannot be set to " + std::to_string(settings.baud) + " baud, " +
                     std::to_string(settings.data_bits) + settings.parity + std::to_string(settings.stop_bits) + ": " +
                     e.what());
  }
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
  impl_->close();
  if (const int error = impl_->claim()) {
    impl_->close();
    return failure(ErrorCode::kNotReady, error, kWhere);
  }
  try {
    impl_->configure();
  } catch (...) {
    impl_->close();
    return failure(ErrorCode::kNotReady, 0, kWhere);
  }
  return {};
}

int SerialPort::descriptor() const noexcept { return impl_->connected() ? impl_->fd : -1; }
const SerialSettings& SerialPort::settings() const noexcept { return impl_->settings; }

}  // namespace tankrig
