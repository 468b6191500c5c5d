// `tankrig session`: sessions out of other scanners' images, and what a session holds.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <tuple>

#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/scan/timing.hpp"
#include "apps/tankrig/session/open_session.hpp"
#include "core/camera_file.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "session/import/planes_csv.hpp"
#include "session/import/session_import.hpp"
#include "session/reading/session_folder.hpp"
#include "session/reading/session_summary.hpp"
#include "session/reading/session_yaml.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

struct ImportOptions {
  std::filesystem::path images, camera, planes, dark, out;
  std::string plane, notes;
  bool json = false;
};

struct SessionInfoOptions {
  std::filesystem::path session;
  bool json = false;
};

struct SessionListOptions {
  std::filesystem::path folder = "sessions";
  std::string rig;  ///< of this one only; empty: of any
  bool json = false;
};

std::uint64_t recorded_frames(const SessionInfo& info) {
  std::uint64_t sum = 0;
  for (const CalibratedCamera& camera : info.cameras)
    if (const auto count = info.counts.find(camera.name + ".recorded"); count != info.counts.end())
      sum += count->second;
  return sum;
}

/// Numbers, with their unit in the key; what is not known is left out.
nlohmann::ordered_json info_json(const Session& session) {
  const SessionInfo& info = session.info;
  nlohmann::ordered_json out{{"session", info.name},
                             {"status", info.status},
                             {"kind", info.kind},
                             {"created_utc", info.created_utc},
                             {"operator", info.operator_name},
                             {"notes", info.notes},
                             {"rig", info.rig},
                             {"software", info.software},
                             {"sensor", info.noise}};
  if (info.kind == "scan") out["seed"] = info.seed;
  if (info.truth_seed) out["truth_seed"] = *info.truth_seed;
  if (info.light) out["light"] = *info.light;
  if (info.lux_before) out["lux_before"] = *info.lux_before;
  if (info.lux_after) out["lux_after"] = *info.lux_after;
  if (info.lux_uncertainty) out["lux_uncertainty"] = *info.lux_uncertainty;
  if (info.simulated_s > 0) out["length_s"] = info.simulated_s;
  out["cameras"] = nlohmann::ordered_json::object();
  for (const CalibratedCamera& camera : info.cameras) {
    nlohmann::ordered_json& c = out["cameras"][camera.name];
    c = {{"role", to_string(camera.role)}, {"width_px", camera.model.width}, {"height_px", camera.model.height}};
    c["frames"] = nlohmann::ordered_json::object();
    for (const FrameRecord& frame : session.frames)
      if (frame.camera == camera.name) {
        nlohmann::ordered_json& count = c["frames"][to_string(frame.phase)];
        count = count.is_null() ? 1 : count.get<int>() + 1;
      }
    if (const auto account = info.account.find(camera.name); account != info.account.end()) {
      c["expected"] = account->second.expected;
      c["unaccounted"] = account->second.unaccounted;
    }
  }
  if (info.kind == "scan") {
    Duration residual{}, sigma{};
    for (const FrameRecord& frame : session.frames) {
      residual = std::max(residual, frame.sync_residual);
      sigma = std::max(sigma, frame.stamp_sigma);
    }
    out["worst_sync_residual_ms"] = 1e3 * seconds(residual);
    out["worst_stamp_sigma_ms"] = 1e3 * seconds(sigma);
  }
  if (info.object) out["object"] = info.object->mesh;
  out["counts"] = info.counts;
  out["devices"] = info.devices;
  if (info.timing) out["timing"] = timing_json(*info.timing);
  out["platform"] = info.platform;
  out["calibration_sha256"] = info.calibration_hash;
  out["warnings"] = session.warnings;
  return out;
}

struct Listed {
  fs::path path;
  SessionInfo info;
  std::string failure;  ///< why session.yaml cannot be read; empty: it can
};

/// Every session in `folder`, by the time of its making. `rig`: of that rig, and those that cannot be read; empty: of any.
std::vector<Listed> sessions_in(const fs::path& folder, const std::string& rig) {
  std::error_code error;
  fs::directory_iterator entries(folder, error);
  if (error) throw InputError(folder, "cannot be read: " + error.message() + ", expected a folder of sessions");
  std::vector<Listed> all;
  for (const fs::directory_entry& entry : entries) {
    if (!entry.is_directory(error) || !fs::exists(entry.path() / "session.yaml", error)) continue;
    Listed listed{entry.path(), {}, {}};
    try {
      refuse_links(entry.path());
      listed.info = read_session_yaml(entry.path() / "session.yaml");
    } catch (const InputError& e) {
      listed.failure = e.what();
    }
    if (rig.empty() || listed.info.rig == rig || !listed.failure.empty()) all.push_back(std::move(listed));
  }
  std::sort(all.begin(), all.end(), [](const Listed& a, const Listed& b) {
    return std::tie(a.info.created_utc, a.path) < std::tie(b.info.created_utc, b.path);
  });
  return all;
}

nlohmann::ordered_json list_json(const Listed& s) {
  nlohmann::ordered_json out{{"session", s.path.string()}};
  if (!s.failure.empty()) {
    out["failure"] = s.failure;
    return out;
  }
  out.update({{"status", s.info.status},
              {"kind", s.info.kind},
              {"created_utc", s.info.created_utc},
              {"rig", s.info.rig},
              {"operator", s.info.operator_name},
              {"frames", recorded_frames(s.info)}});
  if (s.info.lux_before) out["lux_before"] = *s.info.lux_before;
  if (s.info.lux_after) out["lux_after"] = *s.info.lux_after;
  out["lost"] = nlohmann::ordered_json::object();
  for (const auto& [camera, account] : s.info.account)
    if (!lost_nothing(s.info.counts, camera, account))
      out["lost"][camera] = account_line(s.info.counts, camera, account);
  if (s.info.timing) out["timing"] = timing_json(*s.info.timing);
  return out;
}

/// `left_out`: what an import did not take.
void print_info(const Session& session, bool json, const std::vector<std::string>& left_out = {}) {
  if (!json) {
    for (const auto& [what, value] : session_summary(session))
      std::printf("%-22s %s\n", printable(what).c_str(), printable(value).c_str());
    return;
  }
  nlohmann::ordered_json out = info_json(session);
  if (!left_out.empty()) out["left_out"] = left_out;
  print_json(out);
}

int session_info(const SessionInfoOptions& options) {
  Progress progress;
  print_info(open_with_warnings(options.session, progress).session, options.json);
  return kOk;
}

int import_session(const ImportOptions& options) {
  if (options.plane.empty() == options.planes.empty())
    throw InputError("session import: expected either --plane a,b,c,d or --planes FILE.csv");
  ImportRequest request;
  request.images = options.images;
  request.camera = read_camera_file(options.camera);
  if (!options.plane.empty()) request.plane = parse_laser_plane(options.plane);
  if (!options.planes.empty()) request.planes = read_planes_csv(options.planes);
  if (!options.dark.empty()) request.dark = options.dark;
  request.out = options.out;
  request.notes = options.notes;
  request.software = TANKRIG_VERSION;
  const std::vector<std::string> left_out = write_import_session(request);
  Progress progress;
  for (const std::string& image : left_out) progress.warn(image);
  if (!left_out.empty()) progress.warn(fmt::format("images left out: {}", left_out.size()));
  print_info(open_with_warnings(session_path(options.out), progress).session, options.json, left_out);
  return left_out.empty() ? kOk : kPartial;
}

int session_list(const SessionListOptions& options) {
  const std::vector<Listed> sessions = sessions_in(options.folder, options.rig);
  if (options.json) {
    nlohmann::ordered_json out = nlohmann::ordered_json::array();
    for (const Listed& s : sessions) out.push_back(list_json(s));
    print_json(out);
    return kOk;
  }
  const auto print_row = [](const auto&... cells) {
    fmt::print("{:<20}  {:<14}  {:>7}  {:<12}  {:>6}  {:<28}  {}\n", cells...);
  };
  print_row("created", "rig", "lux", "operator", "frames", "session", "status");
  for (const Listed& s : sessions)
    print_row(printable(s.info.created_utc), printable(s.info.rig),
              s.info.lux_before ? fmt::format("{:.0f}", *s.info.lux_before) : "-", printable(s.info.operator_name),
              recorded_frames(s.info), printable(s.path.filename().string()),
              printable(s.failure.empty() ? s.info.status : s.failure));
  return kOk;
}

}  // namespace

void add_session(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* session =
      app.add_subcommand("session", "List, inspect, check, recover, replay, export and import sessions");
  session->require_subcommand(1);
  session->footer("Example: tankrig session info sessions/monday");
  CLI::App* c = session->add_subcommand(
      "import", "Make a session from a folder of stripe images, a camera file and the laser plane");
  ImportOptions& import = options_of(c, chosen, &import_session);
  c->footer(
      "Example: tankrig session import --images photos --camera camera.yaml --plane 0.99989,0.01415,0.00503,0.03952 "
      "--out sessions/imported");
  c->add_option("--images", import.images, "Folder of images, read in the order of their names")->required();
  c->add_option("--camera", import.camera, "Camera calibration: OpenCV YAML or XML, or ROS camera_info YAML")
      ->required();
  CLI::Option* plane = c->add_option("--plane", import.plane,
                                     "Laser plane a,b,c,d: ax + by + cz + d = 0 in the camera frame, in metres");
  c->add_option("--planes", import.planes, "CSV table with the columns file,a,b,c,d: one plane per image")
      ->excludes(plane);
  c->add_option("--dark", import.dark, "Folder of images taken with the laser off");
  c->add_option("--notes", import.notes, "Free text to keep in the session");
  c->add_option("--out", import.out, "Session folder to make")->required();
  add_json_flag(c, import.json);
  c = session->add_subcommand("info", "Print what a session contains");
  SessionInfoOptions& info = options_of(c, chosen, &session_info);
  c->footer("Example: tankrig session info sessions/monday --json");
  add_session_option(c, info.session);
  add_json_flag(c, info.json);
  c = session->add_subcommand("list",
                              "List the sessions in a folder, oldest first: date, rig, lux, operator, frames, status");
  SessionListOptions& list = options_of(c, chosen, &session_list);
  c->footer("Example: tankrig session list --rig tank-sim");
  c->add_option("folder", list.folder, "Folder of sessions")->capture_default_str();
  c->add_option("--rig", list.rig, "Only sessions of this rig, and those that cannot be read");
  c->add_flag("--json", list.json, "Print one JSON array on standard output");
  add_session_check(*session, chosen);
  add_session_replay(*session, chosen);
  add_session_export(*session, chosen);
}

}  // namespace tankrig::app
