// What the last start-up test of a rig has shown, kept beside its rig file.
#pragma once

#include <cstdint>
#include <ctime>
#include <filesystem>
#include <string>
#include <vector>

#include "core/enum_names.hpp"
#include "rig/config/rig_config.hpp"

namespace tankrig {

enum class CommissionStep : std::uint8_t { kDisk, kEncoders, kBeam, kLid, kRelayWatchdog, kEnable };
template <>
inline constexpr std::array kNames<CommissionStep>{"disk", "encoders", "beam", "lid", "relay_watchdog", "enable"};

enum class CommissionVerdict : std::uint8_t { kPassed, kFailed, kWaived };
template <>
inline constexpr std::array kNames<CommissionVerdict>{"passed", "failed", "waived"};

struct CommissionFinding {
  CommissionStep step{};
  CommissionVerdict verdict = CommissionVerdict::kFailed;
  std::string measured;  ///< one line
};

struct CommissionRecord {
  std::string rig{}, rig_sha256{};  ///< its name; commission_basis_sha256()
  std::string made_utc{}, operator_name{}, software{};
  std::vector<CommissionFinding> findings{};  ///< one of every step, in their order

  /// No step failed.
  bool passed() const;
  /// "by Anna at 2026-01-31T12:00:00Z, waived: enable"
  std::string in_words() const;
};

/// Beside the rig file: rig.yaml's is rig.commission.yaml.
std::filesystem::path commission_file(const RigConfig& rig);

/// Of every value in the rig file and its bases: after any change the rig is another one.
std::string commission_basis_sha256(const RigConfig& rig);

/// Errors: InputError with file and line; CannotWrite.
CommissionRecord read_commission(const std::filesystem::path& file);
void write_commission(const std::filesystem::path& file, const CommissionRecord& record);
std::string commission_text(const CommissionRecord& record);

/// How old a record the rig asks for [h]; nothing: none. `hurts`: its devices are real.
std::optional<double> commission_age_limit_h(const SafetySettings& safety, bool hurts);

/// Why `record` does not allow a start of `rig` at `now`; empty if it does.
std::string commission_objection(const CommissionRecord& record, const RigConfig& rig, double limit_h, std::time_t now);

}  // namespace tankrig
