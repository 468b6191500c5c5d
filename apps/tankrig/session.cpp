// `tankrig session`: sessions out of other scanners' images, and what a session holds.
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <tuple>

#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/open_session.hpp"
#include "apps/tankrig/output.hpp"
#include "apps/tankrig/timing.hpp"
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
  if (info.light) out["light"] = *info.light;
  if (info.lux_before) out["lux_before"] = *info.lux_before;
  if (info.lux_after) out["lux_after"] = *info.lux_after;
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
  return out;
}

}  // namespace

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
  write_import_session(request);
  return session_info({session_path(options.out), options.json});
}

int session_info(const SessionInfoOptions& options) {
  Progress progress;
  const Session session = open_with_warnings(options.session, progress).session;
  if (options.json) {
    print_json(info_json(session));
  } else {
    for (const auto& [what, value] : session_summary(session))
      std::printf("%-22s %s\n", printable(what).c_str(), printable(value).c_str());
  }
  return kOk;
}

int session_list(const SessionListOptions& options) {
  const std::vector<Listed> sessions = sessions_in(options.folder, options.rig);
  if (options.json) {
    nlohmann::ordered_json out = nlohmann::ordered_json::array();
    for (const Listed& s : sessions) out.push_back(list_json(s));
    print_json(out);
    return kOk;
  }
  std::printf("%-20s  %-14s  %7s  %-12s  %6s  %-28s  %s\n", "created", "rig", "lux", "operator", "frames", "session",
              "status");
  for (const Listed& s : sessions) {
    char lux[16] = "-";
    if (s.info.lux_before) std::snprintf(lux, sizeof lux, "%.0f", *s.info.lux_before);
    std::printf("%-20s  %-14s  %7s  %-12s  %6llu  %-28s  %s\n", printable(s.info.created_utc).c_str(),
                printable(s.info.rig).c_str(), lux, printable(s.info.operator_name).c_str(),
                static_cast<unsigned long long>(recorded_frames(s.info)), printable(s.path.filename().string()).c_str(),
                printable(s.failure.empty() ? s.info.status : s.failure).c_str());
  }
  return kOk;
}

}  // namespace tankrig::app
