#include "session/reading/session_summary.hpp"

#include <cstdio>
#include <map>

namespace tankrig {
namespace {

std::string rounded(double value, int digits, const char* unit) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f %s", digits, value, unit);
  return text;
}

std::string frames_of(const Session& session, const std::string& camera) {
  std::map<Phase, int> per_phase;
  int all = 0;
  for (const FrameRecord& frame : session.frames)
    if (frame.camera == camera) ++per_phase[frame.phase], ++all;
  std::string out = std::to_string(all) + " frames";
  const char* before = ": ";
  for (const auto& [phase, count] : per_phase)
    out += before + std::to_string(count) + " " + to_string(phase), before = ", ";
  return out;
}

double worst_ms(const Session& session, Duration FrameRecord::*of) {
  Duration worst{};
  for (const FrameRecord& frame : session.frames) worst = std::max(worst, frame.*of);
  return seconds(worst) * 1e3;
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
  if (info.light) add("light", rounded(*info.light, 3, "of the reference"));
  if (info.lux_before) add("lux before", rounded(*info.lux_before, 1, "lx"));
  if (info.lux_after) add("lux after", rounded(*info.lux_after, 1, "lx"));
  if (info.simulated_s > 0) add("length", rounded(info.simulated_s, 2, "s"));
  for (const CalibratedCamera& camera : info.cameras)
    add("camera " + camera.name, std::string(to_string(camera.role)) + ", " + std::to_string(camera.model.width) +
                                     " x " + std::to_string(camera.model.height) + " px, " +
                                     frames_of(session, camera.name));
  for (const auto& [camera, account] : info.account)
    add("frames of " + camera, account_line(info.counts, camera, account));
  if (info.kind == "scan") {
    add("worst distance to a joint sample", rounded(worst_ms(session, &FrameRecord::sync_residual), 3, "ms"));
    add("worst sigma of a stamp", rounded(worst_ms(session, &FrameRecord::stamp_sigma), 3, "ms"));
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
