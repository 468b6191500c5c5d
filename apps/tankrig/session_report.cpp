#include "apps/tankrig/session_report.hpp"

#include "apps/tankrig/pictures.hpp"
#include "apps/tankrig/stop.hpp"
#include "session/checking/checksums.hpp"

namespace tankrig::app {

std::optional<std::vector<Score>> reconstruct_and_report(const Session& session,
                                                         const ReconstructionParameters& parameters,
                                                         const sim::TankWorld* world, Progress& progress) {
  const ObjectSurface object = object_of(session, parameters.thresholds);
  std::vector<Score> scores = reconstruct_and_score(session, parameters, object, StopOnSignal::requested(), progress);
  const bool stopped = StopOnSignal::requested();
  if (!stopped) {
    progress.update("pictures and report", 0);
    write_pictures_and_report(session, object, scores, world);
    progress.update("pictures and report", 1);
  }
  if (session.info.status != "recording") write_checksums(session.path);
  progress.finish_line();
  if (stopped) return std::nullopt;
  return scores;
}

}  // namespace tankrig::app
