#include "apps/tankrig/scan/used_calibration.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/shown_text.hpp"
#include "core/utc.hpp"
#include "session/checking/sha256.hpp"

namespace tankrig::app {
namespace {

constexpr double kOldDays = 30;

/// Days from an ISO 8601 time, which the file's reader has checked.
double days_since(const std::string& utc, std::time_t now) {
  return std::difftime(now, time_of_utc(utc).value_or(0)) / 86400;
}

}  // namespace

std::string calibration_basis_sha256(const RigConfig& nominal) {
  return sha256_of_text(nominal.calibration ? nominal.calibration->basis : calibration_basis(nominal));
}

std::vector<std::string> calibration_warnings(const RigConfig& rig, std::time_t now) {
  std::vector<std::string> out;
  if (!rig.calibration) return out;
  const Calibration& c = rig.calibration->values;
  const std::string file = "calibration " + rig.calibration->file.string() + ": ";
  if (c.verdict == CalibrationVerdict::kUnchecked) out.push_back(file + "was never judged on data that was held back");
  for (const CalibrationCheck& check : c.checks)
    if (!check.passed())
      out.push_back(file + fmt::format("{} is {:.3g} {}, {} is allowed", shown_text(check.name), check.value,
                                       shown_text(check.unit), check.limit));
  if (c.verdict == CalibrationVerdict::kRejected) out.push_back(file + "was rejected: calibrate again");
  if (c.rig != rig.name)
    out.push_back(file + "is of the rig " + shown_text(c.rig) + ", this is " + rig.name);
  else if (c.rig_sha256 != calibration_basis_sha256(rig))
    out.push_back(file + "was made when arm or cameras of " + rig.name + " were others");
  const double days = days_since(c.made_utc, now);
  if (days > kOldDays) out.push_back(file + fmt::format("is {:.0f} days old", days));
  if (days < -1) out.push_back(file + "was made in the future: " + c.made_utc);
  return out;
}

void keep_calibration(const RigConfig& rig, SessionWriter& writer) {
  if (rig.calibration) writer.add_text("calibration.yaml", rig.calibration->text);
}

}  // namespace tankrig::app
