// `tankrig calibrate time`: the cameras' time offset from recorded sweeps there and back.

#include <cmath>
#include <cstdio>
#include <deque>
#include <nlohmann/json.hpp>

#include "apps/tankrig/calibrate/calibrate_commands.hpp"
#include "apps/tankrig/calibrate/calibration_part.hpp"
#include "apps/tankrig/calibrate/facts.hpp"
#include "apps/tankrig/calibrate/time_data.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/session/open_session.hpp"
#include "calibration/time_offset/time_offset.hpp"
#include "core/input_error.hpp"
#include "core/text_files.hpp"
#include "session/checking/checksums.hpp"
#include "session/recording/session_lock.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

struct CalibrateTimeOptions {
  std::vector<std::filesystem::path> sessions;  ///< of one rig; of different speed to tell backlash from time
  WriteOptions write;
  bool json = false;
};

nlohmann::ordered_json distance_json(const CloudDistance& d) {
  return {{"mean_mm", 1e3 * d.mean}, {"median_mm", 1e3 * d.median}, {"rms_mm", 1e3 * d.rms}};
}

nlohmann::ordered_json facts_of(const std::string& camera, Duration applied, const TimeOffsetSolution& s) {
  nlohmann::ordered_json out{
      {"equation", "t_camera = t_joints + time_offset_s"},
      {"camera", camera},
      {"time_offset_s", seconds(applied) + s.offset},
      {"sigma_s", s.sigma},
      {"interval_95_s", {seconds(applied) + s.offset - s.half_width, seconds(applied) + s.offset + s.half_width}},
      {"applied_s", seconds(applied)},
      {"found_s", s.offset},
      {"effect_mm", 1e3 * s.effect},
      {"effect_sigma_mm", 1e3 * s.effect_sigma},
      {"speed_on_target_m_s", s.speed_on_target},
      {"offset_per_backlash_s_rad", s.offset_per_backlash},
      {"clouds_before", distance_json(s.before)},
      {"clouds_after", distance_json(s.after)},
      {"places", s.pairs},
      {"frames", s.stripes},
      {"speeds_rad_s", s.speeds}};
  if (s.backlash) out["backlash_mrad"] = 1e3 * *s.backlash, out["backlash_sigma_mrad"] = 1e3 * s.backlash_sigma;
  return out;
}

void print(const TimeOffsetSolution& s, const nlohmann::ordered_json& facts) {
  std::printf("t_camera = t_joints %c %.3f +- %.3f ms", s.offset < 0 ? '-' : '+', 1e3 * std::abs(s.offset),
              1e3 * s.sigma);
  if (facts.at("applied_s") != 0.0)
    std::printf(", besides the %.3f ms the rig file takes off already", 1e3 * facts.at("applied_s").get<double>());
  std::printf("\n95 %% interval: %.3f to %.3f ms", 1e3 * (s.offset - s.half_width), 1e3 * (s.offset + s.half_width));
  std::printf("\non the target: %.3f +- %.3f mm along the viewing rays (%.0f mm/s)\n", 1e3 * s.effect,
              1e3 * s.effect_sigma, 1e3 * s.speed_on_target);
  std::printf("the clouds there and back: %.3f mm apart before, %.3f mm after (median of %zu places, %zu frames)\n",
              1e3 * s.before.median, 1e3 * s.after.median, s.pairs, s.stripes);
  if (s.backlash)
    std::printf("backlash between encoder and link: %.3f +- %.3f mrad\n", 1e3 * *s.backlash, 1e3 * s.backlash_sigma);
  else
    std::printf(
        "backlash between encoder and link is taken as none: 1 mrad of it would read as %.2f ms; a session of "
        "another speed tells them apart\n",
        s.offset_per_backlash);
  std::printf("for the rig file: camera %s: time_offset_s: %.6f\n", facts.at("camera").get<std::string>().c_str(),
              facts.at("time_offset_s").get<double>());
}

/// The camera's time offset from a sweep there and back; writes results/time_offset.yaml into every session.
/// Errors: InputError, of a session without passes in both directions too.
int calibrate_time(const CalibrateTimeOptions& options) {
  Progress progress;
  std::optional<CalibrationPart> part;
  if (!options.write.file.empty()) part.emplace(options.write);
  std::vector<OpenedSession> sessions;
  std::deque<SessionLock> at_rest;
  for (const fs::path& path : options.sessions) {
    std::error_code unknown;
    for (const OpenedSession& other : sessions)
      if (fs::equivalent(other.session.path, path, unknown))
        throw InputError(path, "is given twice, expected each session once");
    at_rest.emplace_back(path);
    sessions.push_back(open_with_warnings(path, progress));
  }
  const CalibratedCamera& camera = sessions.front().session.camera(CameraRole::kMono);
  const TimeOffsetSolution solution = solve(time_problem(sessions, progress));
  const nlohmann::ordered_json facts = facts_of(camera.name, camera.time_offset, solution);
  for (const OpenedSession& opened : sessions) {
    const Session& session = opened.session;
    fs::create_directories(session.path / "results");
    write_file_durably(session.path / "results" / "time_offset.yaml", yaml_text(facts));
    if (session.info.status != "recording") write_checksums(session.path);
  }
  if (part) {
    part->values.camera(part->camera(CameraRole::kMono).name).time = {
        CalibrationPart::source("there and back", sessions.front().session.path, recorded_files(sessions)),
        camera.time_offset + from_seconds(solution.offset), from_seconds(solution.sigma)};
    part->write();
  }
  progress.finish_line();
  if (options.json)
    print_json(facts);
  else
    print(solution, facts);
  return kOk;
}

}  // namespace

void add_calibrate_time(CLI::App& calibrate, ChosenCommand& chosen) {
  CLI::App* c =
      calibrate.add_subcommand("time", "Find the time offset between camera and joints from a there-and-back sweep");
  CalibrateTimeOptions& o = options_of(c, chosen, &calibrate_time);
  c->footer("Example: tankrig calibrate time sessions/there-and-back --json");
  add_sessions_option(c, o.sessions,
                      "Session folders, each with a there-and-back sweep; two sweep speeds tell "
                      "backlash from a time offset");
  add_write_options(c, o.write);
  add_json_flag(c, o.json);
}

}  // namespace tankrig::app
