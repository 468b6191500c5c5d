#include "session/reading/session_summary.hpp"

#include <fmt/core.h>

#include <map>

namespace tankrig {
namespace {

std::string frames_per_phase(const Session& session, const std::string& camera) {
  std::map<Phase, int> per_phase;
  int all = 0;
  for (const FrameRecord& frame : session.frames)
    if (frame.camera == camera) ++per_phase[frame.phase], ++all;
  std::string out = fmt::format("{} frames", all);
  const char* before = ": ";
  for (const auto& [phase, count] : per_phase)
    out += fmt::format("{}{} {}", std::exchange(before, ", "), count, to_string(phase));
  return out;
}

std::string worst(const Session& session, Duration FrameRecord::*of) {
  Duration longest{};
  for (const FrameRecord& frame : session.frames) longest = std::max(longest, frame.*of);
  return fmt::format("{:.3f} ms", seconds(longest) * 1e3);
}

}  // namespace

std::vector<std::pair<std::string, std::string>> session_summary(const Session& session) {
  const SessionInfo& info = session.info;
  std::vector<std::pair<std::string, std::string>> out;
  const auto add = [&](const std::string& what, const std::string& value) {
    if (!value.empty()) out.emplace_back(what, value);
  };
  add("session", info.name);
  add("status", info.status);
  add("kind", info.kind);
  add("created", info.created_utc);
  add("operator", info.operator_name);
  add("notes", info.notes);
  add("rig", info.rig);
  add("software", info.software);
  add("sensor", info.noise);
  if (info.kind == "scan") add("seed", std::to_string(info.seed));
  if (info.truth_seed) add("seed of the rig's truth", std::to_string(*info.truth_seed));
  if (info.light) add("light", fmt::format("{:.3f} of the reference", *info.light));
  if (info.lux_before) add("lux before", fmt::format("{:.1f} lx", *info.lux_before));
  if (info.lux_after) add("lux after", fmt::format("{:.1f} lx", *info.lux_after));
  if (info.lux_uncertainty) add("lux meter's limit of error", fmt::format("{:.1f} lx", *info.lux_uncertainty));
  if (info.simulated_s > 0) add("length", fmt::format("{:.2f} s", info.simulated_s));
  for (const CalibratedCamera& camera : info.cameras)
    add("camera " + camera.name, fmt::format("{}, {} x {} px, {}", to_string(camera.role), camera.model.width,
                                             camera.model.height, frames_per_phase(session, camera.name)));
  for (const auto& [camera, account] : info.account)
    add("frames of " + camera, account_line(info.counts, camera, account));
  if (info.kind == "scan") {
    add("worst distance to a joint sample", worst(session, &FrameRecord::sync_residual));
    add("worst sigma of a stamp", worst(session, &FrameRecord::stamp_sigma));
  }
  if (info.object) add("object", info.object->mesh);
  for (const auto& [reason, count] : info.counts) add(reason, std::to_string(count));
  if (info.timing)
    for (const auto& [what, value] : timing_summary(*info.timing)) add(what, value);
  for (const auto& [what, found] : info.platform) add("platform " + what, found);
  add("calibration SHA-256", info.calibration_hash);
  for (const std::string& warning : session.warnings) add("warning", warning);
  return out;
}

}  // namespace tankrig
