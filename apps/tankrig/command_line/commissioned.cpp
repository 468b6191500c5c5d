#include "apps/tankrig/command_line/commissioned.hpp"

#include "core/input_error.hpp"
#include "rig/commission/commission_record.hpp"

namespace tankrig::app {

bool hurts(const RigConfig& rig) { return rig.backend != "mock" && !rig.section("emulation"); }

std::string require_commission(const RigConfig& rig, const std::vector<std::string>& waived) {
  const auto limit_h = commission_age_limit_h(rig.scan.safety, hurts(rig));
  if (!limit_h) return {};
  if (!waived.empty()) return std::string("waived: ") + kCommission;
  const std::filesystem::path file = commission_file(rig);
  const std::string cure = ": tankrig doctor --commission --operator NAME --rig " + rig.file.parent_path().string() +
                           " (or --waive " + kCommission + ")";
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) throw InputError(file, "found no start-up test, expected one" + cure);
  const CommissionRecord record = read_commission(file);
  if (const std::string why = commission_objection(record, rig, *limit_h, std::time(nullptr)); !why.empty())
    throw InputError(file, "the start-up test " + why + cure);
  return record.in_words();
}

}  // namespace tankrig::app
