// `tankrig session`: sessions out of other scanners' images, and what a session holds.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/open_session.hpp"
#include "apps/tankrig/output.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "session/import/planes_csv.hpp"
#include "session/import/session_import.hpp"
#include "session/reading/session_summary.hpp"

namespace tankrig::app {

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
  const auto facts = session_summary(session);
  if (options.json) {
    nlohmann::ordered_json out;
    for (const auto& [what, value] : facts)
      if (what != "warning") out[what] = value;
    out["warnings"] = session.warnings;
    print_json(out);
  } else {
    for (const auto& [what, value] : facts)
      std::printf("%-22s %s\n", printable(what).c_str(), printable(value).c_str());
  }
  return kOk;
}

}  // namespace tankrig::app
