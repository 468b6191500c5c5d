#include "apps/tankrig/setup/commission_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/tankrig/arm/arm_motion.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/command_line/start_warning.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/scan/plan_check.hpp"
#include "core/input_error.hpp"
#include "core/utc.hpp"
#include "rig/commission/commission.hpp"
#include "rig/plan/operator_plan.hpp"
#include "rig/platform/machine.hpp"

namespace tankrig::app {
namespace {

std::vector<CommissionStep> steps_named(const std::vector<std::string>& names) {
  std::vector<CommissionStep> steps;
  for (const CommissionStep step : kWaivable)
    if (std::ranges::count(names, name_of(step)) != 0) steps.push_back(step);
  return steps;
}

CommissionFinding disk_finding_of(const RigConfig& rig, const std::filesystem::path& sessions) {
  const Finding room =
      room_finding(sessions, free_space(sessions), disk_need(rig, make_scan_plan(rig.scan, rig.scan.park)));
  return {CommissionStep::kDisk, room.refused ? CommissionVerdict::kFailed : CommissionVerdict::kPassed, room.measured};
}

/// Who stands at the tank is asked on the screen; at an emulated one somebody is there.
void ask(Backend& backend, Deed deed, Duration within, Progress& progress) {
  constexpr const char* kWords[] = {"open the lid", "close the lid", "press the stop", "release the stop"};
  if (backend.does_by_hand(deed)) return;
  progress.finish_line();
  progress.note(fmt::format("NOW: {} (within {:.0f} s)", kWords[static_cast<std::size_t>(deed)], seconds(within)));
}

std::vector<CommissionFinding> unfinished() {
  std::vector<CommissionFinding> findings;
  for (std::size_t i = 0; i < kNames<CommissionStep>.size(); ++i)
    findings.push_back({static_cast<CommissionStep>(i), CommissionVerdict::kFailed, "begun, not finished"});
  return findings;
}

void print(const CommissionRecord& record, const std::filesystem::path& file, bool stopped) {
  for (const CommissionFinding& one : record.findings)
    std::printf("%-14s  %-6s  %s\n", name_of(one.step), name_of(one.verdict), one.measured.c_str());
  const std::string end = record.passed() ? "commissioned " + record.in_words()
                          : stopped       ? "not commissioned: stopped"
                                          : "not commissioned: a step failed";
  std::printf("%s: %s, kept in %s\n", record.rig.c_str(), end.c_str(), file.c_str());
}

nlohmann::ordered_json json_of(const CommissionRecord& record, const std::filesystem::path& file) {
  nlohmann::ordered_json out{{"rig", record.rig},
                             {"passed", record.passed()},
                             {"operator", record.operator_name},
                             {"made_utc", record.made_utc},
                             {"record", file.string()}};
  for (const CommissionFinding& one : record.findings)
    out["steps"].push_back(
        {{"step", name_of(one.step)}, {"verdict", name_of(one.verdict)}, {"measured", one.measured}});
  return out;
}

}  // namespace

std::vector<std::string> waivable_steps() {
  std::vector<std::string> names;
  for (const CommissionStep step : kWaivable) names.emplace_back(name_of(step));
  return names;
}

int run_commission(const std::string& rig_name, const std::filesystem::path& sessions, const CommissionOptions& options,
                   bool json) {
  Progress progress;
  const RigConfig rig = load_rig(find_rig(rig_name));
  if (rig.backend == "mock")
    throw InputError(rig.file, "--commission: found a simulated rig, expected one with devices");
  if (options.operator_name.empty())
    throw InputError("--operator: found nothing, expected the name of whoever stands at the tank");
  const std::filesystem::path file = commission_file(rig);
  const StopOnSignal stop_on_signal;  // before the devices: it outlives them
  const OwnBackend backend = make_backend(rig, {.carrier = options.carrier, .command = "doctor --commission"});
  for (const std::string& warning : backend->warnings()) progress.warn(warning);
  const std::vector<CommissionStep> waived = steps_named(options.waived);
  const JointVector now = homed_posture(*backend, rig_name);
  const bool beam = std::ranges::count(waived, CommissionStep::kBeam) == 0;
  const JointVector posture = beam ? commission_posture(rig, now) : now;
  std::optional<ScanPlan> way;
  if (posture != now) way = make_move_plan(rig.scan, now, posture, "move to where the beam is tried");
  if (way) check_plan(rig, *way);
  const SafetySettings& safety = rig.scan.safety;
  CommissionJob job{.rig = rig,
                    .way = way ? &*way : nullptr,
                    .posture = posture,
                    .clock = backend->clock(),
                    .arm = backend->arm(),
                    .laser = backend->laser(),
                    .relay = backend->relay_proof(),
                    .cameras = backend->cameras(),
                    .has_enable_input = safety.enable_input.kind != EnableKind::kNone,
                    .reads_interlock = backend->reads_interlock(),
                    .interlock_closed = [&] { return backend->interlock_closed(); },
                    .stop = StopOnSignal::requested(),
                    .ask = [&](Deed deed, Duration within) { ask(*backend, deed, within, progress); },
                    .run =
                        [&](ScanJob& run) {
                          run.cut = [&](const std::string& what) { progress.cut(what); };
                          Motion(*backend, safety, progress).run(run);
                        },
                    .progress = [&](const std::string& step, double fraction) { progress.update(step, fraction); },
                    .patience = from_seconds(options.wait_s),
                    .waived = waived};
  const ScanPlan rocking = commission_motion(rig.scan, rig.arm, posture, job.patience);
  check_plan(rig, rocking);
  const StartWarning warning(rig, *backend,
                             (way ? what_will_happen(*way) + ", then " : "") + what_will_happen(rocking) +
                                 fmt::format(", and its laser will shine for up to {:.0f} s", commission_light_s(job)),
                             options.yes, progress);
  const RigStops stops(*backend, progress);
  make_laser_dark(*backend, rig.scan);

  CommissionRecord record{.rig = rig.name,
                          .rig_sha256 = commission_basis_sha256(rig),
                          .operator_name = options.operator_name,
                          .software = TANKRIG_VERSION};
  record.made_utc = utc_now();
  record.findings = unfinished();
  write_commission(file, record);  // whatever becomes of this one, no older one counts any more
  record.findings = commission(job, disk_finding_of(rig, sessions));
  record.made_utc = utc_now();
  write_commission(file, record);
  progress.finish_line();
  if (json)
    print_json(json_of(record, file));
  else
    print(record, file, StopOnSignal::requested());
  if (record.passed()) return kOk;
  return StopOnSignal::requested() ? kPartial : kFailure;
}

}  // namespace tankrig::app
