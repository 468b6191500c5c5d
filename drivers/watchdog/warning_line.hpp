// A lamp or a sounder that warns people before anything moves or shines.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "core/config_node.hpp"
#include "core/enum_names.hpp"
#include "core/result.hpp"

namespace tankrig {

enum class WarningKind : std::uint8_t { kNone, kRts, kDtr, kBytes };
template <>
inline constexpr std::array kNames<WarningKind>{"none", "rts", "dtr", "bytes"};

/// The rig file's `scan: safety: warning_output:`. The bytes are those of a usual relay board on USB.
struct WarningOutput {
  WarningKind kind = WarningKind::kNone;
  std::string device;  ///< a serial line
  int baud = 9600;     ///< of bytes
  std::string on_hex = "A00101A2", off_hex = "A00100A1";
};
extern const SettingsTable<WarningOutput> kWarningOutputKeys;

/// Threads: one.
class WarningLine {
 public:
  virtual ~WarningLine() = default;
  virtual Status set(bool on) noexcept = 0;
};

/// Off; nothing if the settings name none. `runtime/` is in `runtime`.
/// Errors: InputError that says what to do.
std::unique_ptr<WarningLine> open_warning_line(const WarningOutput& settings, const std::filesystem::path& runtime);

}  // namespace tankrig
