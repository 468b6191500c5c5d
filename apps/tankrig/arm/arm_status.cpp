// `tankrig arm status`: what the arm says of itself, moved by nobody.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/arm/arm_commands.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/devices/backend.hpp"
#include "core/angles.hpp"
#include "core/input_error.hpp"
#include "rig/scan/scan_log.hpp"

namespace tankrig::app {
namespace {

using namespace std::chrono_literals;

constexpr Duration kListen = 500ms, kFirstState = 2s;

struct ArmReport {
  JointState state;  ///< newest
  int states = 0;    ///< heard in `listened`
  Duration listened{};
  JointVector fastest = JointVector::Zero();  ///< largest measured speed [rad/s]
  double peak_current_a = 0;
  std::string failure;  ///< the driver's first, while listening; empty if there was none
  std::string refusal;  ///< why the arm takes no set-point, empty if it does
  bool refused_as_not_homed = false;
  std::string why_not_homed;  ///< where there is a zero file

  /// An arm that is not homed counts ticks, but its angles are not numbers.
  bool homed() const { return !refused_as_not_homed && state.q.allFinite(); }
  bool at_rest(const RigConfig& rig) const { return (fastest.array() < rig.scan.safety.rest_velocity).all(); }
};

/// Listens for a while.
/// Errors: InputError if the arm says nothing, with the driver's reason if there is one.
ArmReport listen(Arm& arm, Clock& clock) {
  ArmReport report;
  const Stamp begin = clock.now();
  Stamp end = begin + kFirstState;
  while (clock.now() < end) {
    const auto news = arm.try_read();
    if (!news.ok() && report.failure.empty()) report.failure = describe(news.error());
    if (news.ok() && news.value()) {
      if (report.states++ == 0) end = clock.now() + kListen;
      report.state = *news.value();
      for (int j = 0; j < kJoints; ++j)  // what is not a number stays one
        if (!(report.state.velocity.cwiseAbs()[j] <= report.fastest[j]))
          report.fastest[j] = std::abs(report.state.velocity[j]);
      report.peak_current_a = std::max(report.peak_current_a, report.state.current_a);
    }
    clock.sleep_until(clock.now() + std::max<Duration>(arm.exchange_period() / 2, 1ms));
  }
  if (report.states == 0)
    throw InputError(report.failure.empty() ? "arm: found no joint state, expected one within 2 s" : report.failure);
  report.listened = clock.now() - begin;
  const Status rest = arm.rest();
  if (!rest.ok()) {
    report.refusal = describe(rest.error());
    report.refused_as_not_homed = rest.error().code == ErrorCode::kNotReady;
  }
  return report;
}

nlohmann::ordered_json json_of(const ArmReport& r, const RigConfig& rig, const Arm& arm) {
  nlohmann::ordered_json out;
  out["rig"] = rig.name;
  out["homed"] = r.homed();
  if (!r.why_not_homed.empty()) out["not_homed"] = r.why_not_homed;
  out["at_rest"] = r.homed() ? nlohmann::ordered_json(r.at_rest(rig)) : nlohmann::ordered_json();
  if (!r.failure.empty()) out["failure"] = r.failure;
  if (!r.refusal.empty()) out["refusal"] = r.refusal;
  for (int j = 0; j < kJoints; ++j)
    out["joints"].push_back({{"name", kJointNames[j]},
                             {"angle_deg", to_degrees(r.state.q[j])},
                             {"angle_rad", r.state.q[j]},
                             {"lower_deg", to_degrees(rig.arm.limits[j].lower)},
                             {"upper_deg", to_degrees(rig.arm.limits[j].upper)},
                             {"ticks", r.state.ticks[j]},
                             {"velocity_deg_s", to_degrees(r.state.velocity[j])}});
  out["current_a"] = r.state.current_a;
  out["peak_current_a"] = r.peak_current_a;
  out["exchange_period_s"] = seconds(arm.exchange_period());
  out["states"] = r.states;
  out["listened_s"] = seconds(r.listened);
  out["statistics"] = nlohmann::ordered_json::object();
  for (const Statistic& s : arm.statistics()) out["statistics"][s.name] = s.value;
  return out;
}

/// `value` without a minus before nothing, or a dash where it is not known.
std::string cell(const char* format, double value) {
  char text[32];
  std::snprintf(text, sizeof text, format, std::abs(value) < 5e-5 ? 0.0 : value);
  if (std::isfinite(value)) return text;
  return std::string(std::char_traits<char>::length(text) - 1, ' ') + "-";
}

void print(const ArmReport& r, const RigConfig& rig, const std::string& rig_name, const Arm& arm) {
  std::printf("%-12s %12s %12s %22s %9s %15s\n", "joint", "angle", "", "limits", "ticks", "velocity");
  for (int j = 0; j < kJoints; ++j)
    std::printf("%-12s %s deg %s rad %7.2f to %7.2f deg %9d %s deg/s\n", kJointNames[j],
                cell("%8.2f", to_degrees(r.state.q[j])).c_str(), cell("%8.4f", r.state.q[j]).c_str(),
                to_degrees(rig.arm.limits[j].lower), to_degrees(rig.arm.limits[j].upper), r.state.ticks[j],
                cell("%9.2f", to_degrees(r.state.velocity[j])).c_str());
  const std::string why = r.why_not_homed.empty() ? "" : r.why_not_homed + ": ";
  std::printf("%-28s %s\n", "homed", r.homed() ? "yes" : ("no: " + why + "tankrig arm home --rig " + rig_name).c_str());
  if (r.homed()) std::printf("%-28s %s\n", "at rest", r.at_rest(rig) ? "yes" : "no");
  if (!r.refusal.empty()) std::printf("%-28s %s\n", "takes no set-point", r.refusal.c_str());
  if (!r.failure.empty()) std::printf("%-28s %s\n", "failure", r.failure.c_str());
  std::printf("%-28s %.2f A, at most %.2f A\n", "supply current", r.state.current_a, r.peak_current_a);
  std::printf("%-28s every %.2f ms; %d states in %.2f s\n", "exchange", 1e3 * seconds(arm.exchange_period()), r.states,
              seconds(r.listened));
  for (const Statistic& s : arm.statistics())
    if (s.value != 0) std::printf("%-28s %g\n", s.name.c_str(), s.value);
}

}  // namespace

int arm_status(const ArmCommandOptions& options) {
  const RigConfig rig = load_rig(find_rig(options.rig));
  const OwnBackend backend =
      make_backend(rig, {.carrier = options.carrier, .need = {.laser = false, .cameras = false}});
  Progress progress;
  if (!backend->laser_unknown().empty()) progress.warn(backend->laser_unknown());
  ArmReport report = listen(backend->arm(), backend->clock());
  if (Arm5e* const arm = backend->homed_arm()) {
    report.why_not_homed = arm->why_not_homed();
    try {
      arm->keep_loss();
    } catch (const InputError& e) {
      progress.warn(std::string("the loss of the arm's zero is not kept: ") + e.what());
    }
  }
  if (options.json)
    print_json(json_of(report, rig, backend->arm()));
  else
    print(report, rig, options.rig, backend->arm());
  return kOk;
}

}  // namespace tankrig::app
