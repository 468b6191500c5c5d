#include "drivers/watchdog/warning_line.hpp"

#include <sys/ioctl.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>
#include <vector>

#include "core/input_error.hpp"
#include "core/settings_table.hpp"
#include "drivers/device_path.hpp"
#include "drivers/serial/serial_port.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kMostBytes = 16;

/// Nothing if these are no bytes.
std::optional<std::vector<std::uint8_t>> bytes_of(const std::string& hex) {
  if (hex.empty() || hex.size() % 2 != 0 || hex.size() > 2 * kMostBytes) return {};
  std::vector<std::uint8_t> bytes(hex.size() / 2);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const char* const at = hex.data() + 2 * i;
    if (std::from_chars(at, at + 2, bytes[i], 16).ptr != at + 2) return {};
  }
  return bytes;
}

const Setting<WarningOutput> kWarningOutputRows[] = {
    {"kind", &WarningOutput::kind, "a lamp or sounder, on from the warning to the command's end"},
    {"device", &WarningOutput::device, "its serial line", Need::kSparse},
    {"baud", &WarningOutput::baud, ConfigRange(50, 4e6), "of `bytes`"},
    {"on_hex", &WarningOutput::on_hex, "what switches it on, 1 to 16 bytes in hexadecimal"},
    {"off_hex", &WarningOutput::off_hex, "what switches it off"},
};
void check_warning(const ConfigNode& node, const WarningOutput& output) {
  if (output.kind == WarningKind::kNone) return;
  if (output.device.empty()) node.fail("kind", "found no device beside it, expected the serial line of the lamp");
  if (output.kind != WarningKind::kBytes) return;
  for (const auto& [key, hex] : {std::pair{"on_hex", output.on_hex}, std::pair{"off_hex", output.off_hex}})
    if (!bytes_of(hex)) node.fail(key, "found '" + hex + "', expected 1 to 16 bytes in hexadecimal, such as A00101A2");
}

class ControlLamp final : public WarningLine {
 public:
  ControlLamp(const std::string& device, int bit) : port_({.device = device}), bit_(bit) {
    if (const Status off = set(false); !off.ok())
      throw InputError("safety: warning_output: " + device + " has no control lines (" +
                       std::strerror(off.error().os_errno) +
                       "), expected a serial adapter that has; or kind: bytes, or none");
  }
  ~ControlLamp() override { [[maybe_unused]] const Status off = set(false); }
  Status set(bool on) noexcept override {
    if (::ioctl(port_.descriptor(), on ? TIOCMBIS : TIOCMBIC, &bit_) == 0) return {};
    return Error{ErrorCode::kDisconnected, errno, {}, "warning output"};
  }

 private:
  SerialPort port_;
  const int bit_;
};

class ByteLamp final : public WarningLine {
 public:
  ByteLamp(const SerialSettings& line, std::vector<std::uint8_t> on, std::vector<std::uint8_t> off)
      : port_(line), on_(std::move(on)), off_(std::move(off)) {
    [[maybe_unused]] const Status dark = set(false);
  }
  ~ByteLamp() override { [[maybe_unused]] const Status dark = set(false); }
  Status set(bool on) noexcept override {
    const std::vector<std::uint8_t>& bytes = on ? on_ : off_;
    const auto sent = port_.try_write(bytes);
    if (!sent.ok()) return sent.error();
    return sent.value() == bytes.size() ? Status{} : Error{ErrorCode::kTimeout, 0, {}, "warning output: line is full"};
  }

 private:
  SerialPort port_;
  const std::vector<std::uint8_t> on_, off_;
};

}  // namespace

constinit const SettingsTable<WarningOutput> kWarningOutputKeys{kWarningOutputRows, check_warning};

std::unique_ptr<WarningLine> open_warning_line(const WarningOutput& settings, const std::filesystem::path& runtime) {
  const std::string device = device_path(settings.device, runtime);
  switch (settings.kind) {
    case WarningKind::kNone:
      return nullptr;
    case WarningKind::kRts:
      return std::make_unique<ControlLamp>(device, TIOCM_RTS);
    case WarningKind::kDtr:
      return std::make_unique<ControlLamp>(device, TIOCM_DTR);
    case WarningKind::kBytes:
      break;
  }
  return std::make_unique<ByteLamp>(SerialSettings{.device = device, .baud = settings.baud},
                                    bytes_of(settings.on_hex).value(), bytes_of(settings.off_hex).value());
}

}  // namespace tankrig
