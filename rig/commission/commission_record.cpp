#include "rig/commission/commission_record.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "core/atomic_file.hpp"
#include "core/settings_table.hpp"
#include "core/shown_text.hpp"
#include "core/utc.hpp"
#include "session/checking/sha256.hpp"

namespace tankrig {
namespace {

constexpr const char* kFormat = "tankrig-commission 1";
constexpr double kClockSlack_h = 1.0 / 60;  // of a wall clock that was set meanwhile

using Record = CommissionRecord;

void read_format(const ConfigNode& node, const char* key, Record&) { static_cast<void>(node.choice(key, {kFormat})); }
void write_format(YAML::Emitter& out, const Record&) { out << kFormat; }

const Setting<CommissionFinding> kFindingRows[] = {
    {"step", &CommissionFinding::step, "", Need::kRequired},
    {"verdict", &CommissionFinding::verdict, "", Need::kRequired},
    {"measured", &CommissionFinding::measured, "", Need::kRequired},
};
constexpr SettingsTable<CommissionFinding> kFinding{kFindingRows};

void read_findings(const ConfigNode& node, const char* key, Record& record) {
  for (const ConfigNode& one : node.items(key)) record.findings.push_back(settings_from(one, kFinding));
  bool whole = record.findings.size() == kNames<CommissionStep>.size();
  for (std::size_t i = 0; whole && i < record.findings.size(); ++i)
    whole = record.findings[i].step == static_cast<CommissionStep>(i);
  if (!whole) node.fail(key, "found other steps, expected every step once, in their order");
}
void write_findings(YAML::Emitter& out, const Record& record) {
  out << YAML::BeginSeq;
  for (const CommissionFinding& one : record.findings) write_mapping(out, kFinding, one);
  out << YAML::EndSeq;
}

const Setting<Record> kRecordRows[] = {
    {"format", {read_format, write_format, kFormat}, "", Need::kRequired},
    {"rig", &Record::rig, "", Need::kRequired},
    {"rig_sha256", &Record::rig_sha256, "", Need::kRequired},
    {"made_utc", &Record::made_utc, "", Need::kRequired},
    {"operator", &Record::operator_name, "", Need::kRequired},
    {"software", &Record::software, "", Need::kRequired},
    {"findings", {read_findings, write_findings, ""}, "", Need::kRequired},
};
void check_record(const ConfigNode& node, const Record& record) {
  if (!time_of_utc(record.made_utc))
    node.fail("made_utc", "found '" + shown_text(record.made_utc) + "', expected a time like 2026-01-31T12:00:00Z");
  if (record.operator_name.empty()) node.fail("operator", "found nothing, expected a name");
}
constexpr SettingsTable<Record> kRecord{kRecordRows, check_record};

}  // namespace

bool CommissionRecord::passed() const {
  return !findings.empty() && std::none_of(findings.begin(), findings.end(), [](const CommissionFinding& one) {
    return one.verdict == CommissionVerdict::kFailed;
  });
}

std::string CommissionRecord::in_words() const {
  std::string waived;
  for (const CommissionFinding& one : findings)
    if (one.verdict == CommissionVerdict::kWaived)
      waived += (waived.empty() ? "" : ", ") + std::string(name_of(one.step));
  return "by " + operator_name + " at " + made_utc + (waived.empty() ? "" : ", waived: " + waived);
}

std::filesystem::path commission_file(const RigConfig& rig) {
  std::filesystem::path file = rig.file;
  return file.replace_extension(".commission.yaml");
}

std::string commission_basis_sha256(const RigConfig& rig) {
  YAML::Emitter out;
  rig.root.write(out);
  return sha256_of_text(out.c_str());
}

CommissionRecord read_commission(const std::filesystem::path& file) {
  return settings_from(ConfigNode::load(file), kRecord);
}

std::string commission_text(const CommissionRecord& record) {
  YAML::Emitter out;
  out << YAML::Comment("The last start-up test: tankrig doctor --commission.");
  write_mapping(out, kRecord, record);
  return std::string(out.c_str()) + "\n";
}

void write_commission(const std::filesystem::path& file, const CommissionRecord& record) {
  write_file_durably(file, commission_text(record));
}

std::optional<double> commission_age_limit_h(const SafetySettings& safety, bool hurts) {
  constexpr double kWithDevices_h = 24;
  return safety.commissioned_within_h || !hurts ? safety.commissioned_within_h : std::optional(kWithDevices_h);
}

std::string commission_objection(const CommissionRecord& record, const RigConfig& rig, double limit_h,
                                 std::time_t now) {
  if (record.rig != rig.name) return "is of the rig " + shown_text(record.rig) + ", expected " + rig.name;
  if (!record.passed()) {
    std::string failed;
    for (const CommissionFinding& one : record.findings)
      if (one.verdict == CommissionVerdict::kFailed)
        failed += (failed.empty() ? "" : ", ") + std::string(name_of(one.step));
    return "has steps that failed (" + failed + "), expected none";
  }
  if (record.rig_sha256 != commission_basis_sha256(rig)) return "was made before the rig file was changed";
  const double age_h = std::difftime(now, time_of_utc(record.made_utc).value_or(0)) / 3600;
  if (age_h < -kClockSlack_h) return "was made in the future, " + record.made_utc + ": set this machine's clock";
  if (age_h > limit_h)
    return fmt::format("is {:.1f} h old, expected at most {:g} h (scan.safety.commissioned_within_h)", age_h, limit_h);
  return {};
}

}  // namespace tankrig
