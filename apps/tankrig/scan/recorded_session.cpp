#include "apps/tankrig/scan/recorded_session.hpp"

#include <fmt/format.h>

#include "apps/tankrig/devices/scene_check.hpp"
#include "apps/tankrig/session/open_session.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "session/recording/spool.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

/// Errors: InputError if it is of another rig.
bool is_complete(const fs::path& path, const RigConfig& rig, const sim::WorldOptions& world) {
  if (!fs::exists(path / "session.yaml")) return false;
  const SessionInfo info = Session::open(path).info;
  if (info.rig != rig.name)
    throw InputError(path, "is of rig " + shown_text(info.rig) + ", expected " + rig.name + ": take another folder");
  if (const auto truth = true_rig(rig, world); truth && info.truth_seed && info.truth_seed != truth->seed)
    throw InputError(path, fmt::format("is of the rig of --truth-seed {}, expected {}: take another folder",
                                       *info.truth_seed, truth->seed));
  return info.status == "complete";
}

void record(const ScanOptions& options, const RigConfig& rig, const fs::path& path, const ReadyRig::PlanFrom& plan_from,
            Progress& progress) {
  ReadyRig ready(options, rig, path, plan_from, progress);
  const Recording recording = record_session(options, rig, nullptr, ready.plan(), ready.backend(), path,
                                             ready.commission(), progress, ready.motion());
  ready.disarm();
  progress.finish_line();
  if (!recording.result.complete())
    throw InputError(path, "the recording " + recording.result.status + "; run the same command again to go on");
}

}  // namespace

std::optional<OpenedSession> session_so_far(const fs::path& path, const RigConfig& rig, const sim::WorldOptions& world,
                                            Progress& progress) {
  if (!fs::exists(path / "session.yaml") || has_spool(path)) return std::nullopt;
  is_complete(path, rig, world);
  return open_with_warnings(path, progress);
}

void put_aside(const fs::path& path, const std::string& why, Progress& progress) {
  const std::string first = path.string() + "." + why;
  fs::path aside = first;
  for (int n = 2; fs::exists(aside); ++n) aside = first + "-" + std::to_string(n);
  fs::rename(path, aside);
  progress.note(printable(path.string()) + ": now " + printable(aside.filename().string()) + ", recorded again");
}

OpenedSession recorded_session(ScanOptions options, const RigConfig& rig, const fs::path& path,
                               const ReadyRig::PlanFrom& plan_from, Progress& progress,
                               const std::function<void(ScanOptions&)>& before) {
  if (fs::exists(path) && is_complete(path, rig, options.world)) {
    progress.note("found " + printable(path.string()) + ", recorded already");
  } else {
    if (fs::exists(path)) put_aside(path, "stopped", progress);
    before(options);
    record(options, rig, path, plan_from, progress);
  }
  return open_with_warnings(path, progress);
}

}  // namespace tankrig::app
