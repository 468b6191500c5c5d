#include "apps/tankrig/calibrate/time_data.hpp"

#include <cmath>
#include <map>
#include <set>

#include "core/input_error.hpp"
#include "pipeline/reconstruct_session.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

void check_passes(const Session& session, const std::vector<const FrameRecord*>& frames) {
  std::set<int> passes;
  for (const FrameRecord* frame : frames) passes.insert(frame->pass);
  if (passes.size() < 2)
    throw InputError(session.path, "found " + std::to_string(passes.size()) +
                                       (passes.size() == 1 ? " pass" : " passes") +
                                       " of the sweep with the laser on, expected one there and one back: scan with "
                                       "passes: 2 and there_and_back: true");
}

/// Stripes as the laser method finds them, and the joints beside them.
TimeOffsetRecording recording_of(const OpenedSession& opened, const CalibratedCamera& camera, bool& rows,
                                 Progress& progress) {
  const Session& session = opened.session;
  const std::vector<const FrameRecord*> frames = frames_of(session, camera, lit_sweep);
  check_passes(session, frames);
  TimeOffsetRecording recording;
  recording.joints = timed_joints(opened);
  const Reconstruction found = reconstruct_session(session, pipeline_parameters(session), "laser", progress.callback());
  rows = found.orientation == StripeOrientation::kRows;
  std::map<int, std::size_t> stripe_of;
  for (const FrameRecord* frame : frames) {
    stripe_of[frame->index] = recording.stripes.size();
    recording.stripes.push_back({frame->stamp, frame->pass, {}});
  }
  for (const StripeRow& row : found.rows)
    if (const auto stripe = stripe_of.find(row.frame); stripe != stripe_of.end())
      recording.stripes[stripe->second].points.push_back(
          {static_cast<int>(std::lround(row.peak.column)), row.peak.position, row.peak.sigma_px});
  return recording;
}

}  // namespace

bool lit_sweep(const FrameRecord& frame) { return frame.phase == Phase::kSweep && frame.laser_on && frame.q; }

std::vector<TimedJoints> timed_joints(const OpenedSession& opened) {
  std::vector<TimedJoints> joints;
  for (const JointState& state : opened.joints) joints.push_back({state.stamp, state.q});
  if (joints.size() < 2)
    throw InputError(opened.session.path / "joints.csv",
                     "found " + std::to_string(joints.size()) + " joint samples, expected those of a scan");
  return joints;
}

std::vector<fs::path> recorded_files(const std::vector<OpenedSession>& sessions) {
  std::vector<fs::path> files;
  for (const OpenedSession& opened : sessions) {
    const Session& session = opened.session;
    for (const char* name : {"session.yaml", "joints.csv", "frames.csv"}) files.push_back(session.path / name);
    for (const FrameRecord* frame : frames_of(session, session.camera(CameraRole::kMono), lit_sweep))
      files.push_back(session.path / frame->file);
  }
  return files;
}

TimeOffsetProblem time_problem(const std::vector<OpenedSession>& sessions, Progress& progress) {
  TimeOffsetProblem problem;
  const Session& first = sessions.front().session;
  for (const OpenedSession& opened : sessions) {
    const Session& session = opened.session;
    const CalibratedCamera& camera = session.camera(CameraRole::kMono);
    if (!session.info.calibration.arm || !session.info.calibration.ePl)
      throw InputError(session.path / "session.yaml", "calibration: found no arm or no ePl, expected those of a scan");
    problem.camera = camera.model;
    problem.cMb = camera.bMc.inverse();
    problem.arm = *session.info.calibration.arm;
    problem.ePl = *session.info.calibration.ePl;
    problem.recordings.push_back(recording_of(opened, camera, problem.rows, progress));
    if (camera.time_offset != first.camera(CameraRole::kMono).time_offset)
      throw InputError(session.path / "session.yaml", "cameras: time_offset_s: found another one than in " +
                                                          first.path.string() +
                                                          ", expected sessions of one calibration");
  }
  return problem;
}

}  // namespace tankrig::app
