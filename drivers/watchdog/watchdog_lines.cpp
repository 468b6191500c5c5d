#include "drivers/watchdog/watchdog_lines.hpp"

#include <sys/ioctl.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "core/input_error.hpp"
#include "drivers/device_path.hpp"
#include "drivers/serial/serial_port.hpp"
#include "drivers/watchdog/box_frames.hpp"
#include "drivers/watchdog/gpio_lines.hpp"

namespace tankrig {
namespace {

int bit_of(HeartbeatKind kind) { return kind == HeartbeatKind::kRts ? TIOCM_RTS : TIOCM_DTR; }

int bit_of(EnableKind kind) {
  switch (kind) {
    case EnableKind::kCts:
      return TIOCM_CTS;
    case EnableKind::kDsr:
      return TIOCM_DSR;
    case EnableKind::kDcd:
      return TIOCM_CD;
    default:
      return TIOCM_RI;
  }
}

/// One line toggles, another is read; either may be unused (0).
class ControlLines final : public HeartbeatLine, public EnableLine {
 public:
  /// Errors: InputError for a line without control lines.
  ControlLines(const std::string& device, const char* key) : port_({.device = device}) {
    int lines = 0;
    if (::ioctl(port_.descriptor(), TIOCMGET, &lines) != 0)
      throw InputError("safety: " + std::string(key) + ": " + device + " has no control lines (" +
                       std::strerror(errno) + "), expected a serial adapter that has; or kind: bytes");
  }
  void set_output(int bit) noexcept { output_ = bit; }
  void set_input(int bit, bool closed_is_on) noexcept {
    input_ = bit;
    closed_is_on_ = closed_is_on;
  }

  Status edge() noexcept override {
    on_ = !on_;
    if (::ioctl(port_.descriptor(), on_ ? TIOCMBIS : TIOCMBIC, &output_) == 0) return {};
    return Error{ErrorCode::kDisconnected, errno, {}, "watchdog box: heartbeat"};
  }

  Result<std::optional<bool>> read() noexcept override {
    int lines = 0;
    if (::ioctl(port_.descriptor(), TIOCMGET, &lines) != 0)
      return Error{ErrorCode::kDisconnected, errno, {}, "watchdog box: enable input"};
    return std::optional<bool>(((lines & input_) != 0) == closed_is_on_);
  }

 private:
  SerialPort port_;
  int output_ = 0, input_ = 0;
  bool on_ = false, closed_is_on_ = true;
};

/// Numbered frames out, the box's replies in.
class ByteLine final : public HeartbeatLine, public EnableLine {
 public:
  explicit ByteLine(const SerialSettings& settings) : port_(settings) {}

  Status edge() noexcept override {
    const auto sent = port_.try_write(encode_box(kBeatLead, {0, ++beat_}));
    return sent.ok() ? Status{} : sent.error();
  }

  Result<std::optional<bool>> read() noexcept override {
    std::array<std::uint8_t, 64> bytes;
    std::optional<bool> newest;
    for (;;) {
      const auto got = port_.try_read(bytes);
      if (!got.ok()) return got.error();
      for (std::size_t i = 0; i < got.value(); ++i)
        if (const auto reply = reader_.take(bytes[i])) newest = (reply->value & kBoxEnabled) != 0;
      if (got.value() < bytes.size()) return newest;
    }
  }

 private:
  SerialPort port_;
  BoxReader reader_{kReplyLead};
  std::uint8_t beat_ = 0;
};

}  // namespace

WatchdogLines open_watchdog_lines(const WatchdogSettings& settings, const std::filesystem::path& runtime) {
  const HeartbeatOutput& output = settings.heartbeat;
  const EnableInput& input = settings.enable;
  const std::string out = device_path(output.device, runtime);
  const std::string in = input.device.empty() ? out : device_path(input.device, runtime);
  const bool beats = output.kind != HeartbeatKind::kNone, reads = input.kind != EnableKind::kNone;
  WatchdogLines lines;
  const bool reads_gpio = input.kind == EnableKind::kGpio;
  if (reads && !reads_gpio && in.empty())
    throw InputError("safety: enable_input: found no device, expected its serial line");
  if (input.kind == EnableKind::kReply && (output.kind != HeartbeatKind::kBytes || in != out))
    throw InputError(
        "safety: enable_input: found kind reply, expected heartbeat_output of kind bytes on the same line");
  if (output.kind == HeartbeatKind::kBytes && reads && !reads_gpio && input.kind != EnableKind::kReply && in == out)
    throw InputError("safety: enable_input: found a control line of the line that carries bytes, expected kind reply");
  if (output.kind == HeartbeatKind::kBytes) {
    const auto line = std::make_shared<ByteLine>(SerialSettings{.device = out, .baud = output.baud});
    lines.heartbeat = line;
    if (input.kind == EnableKind::kReply) lines.enable = line;
  } else if (output.kind == HeartbeatKind::kGpio) {
    lines.heartbeat = open_gpio_heartbeat({output.chip, output.line}, "heartbeat_output");
  } else if (beats) {
    const auto line = std::make_shared<ControlLines>(out, "heartbeat_output");
    line->set_output(bit_of(output.kind));
    lines.heartbeat = line;
    if (reads && !reads_gpio && in == out) {
      line->set_input(bit_of(input.kind), input.closed_is_on);
      lines.enable = line;
    }
  }
  if (reads_gpio) {
    const std::string& chip = input.chip.empty() ? output.chip : input.chip;
    if (chip.empty()) throw InputError("safety: enable_input: found gpio without a chip, expected one: /dev/gpiochip0");
    lines.enable = open_gpio_enable({chip, input.line}, input.closed_is_on, "enable_input");
  } else if (reads && !lines.enable) {
    const auto line = std::make_shared<ControlLines>(in, "enable_input");
    line->set_input(bit_of(input.kind), input.closed_is_on);
    lines.enable = line;
  }
  return lines;
}

}  // namespace tankrig
