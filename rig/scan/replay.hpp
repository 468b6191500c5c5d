// Feeds a recorded scan to the code that recorded it: joints, laser and frames in the order of their stamps.
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "rig/capture/scan_sink.hpp"
#include "rig/plan/scan_plan.hpp"
#include "session/reading/session.hpp"
#include "session/reading/session_tables.hpp"

namespace tankrig {

/// A session's record of what went into joining its frames.
struct RecordedScan {
  ScanPlan plan;
  Stamp plan_zero{};
  std::vector<JointState> joints;
  std::vector<SessionEvent> events;
};

/// Why a session cannot be replayed: "is an import: ...", "was recorded without plan.csv". Empty: it can.
std::string why_not_replayable(const Session& session);

/// Errors: InputError with file and line.
RecordedScan read_recorded_scan(const Session& session);

struct ReplayCounts {
  std::size_t joints = 0, frames = 0;
  std::map<std::string, std::uint64_t> refused;  ///< frames the joiner does not take again, "CAMERA.REASON"
};

/// Feeds JointHistory, LaserTimeline and FrameJoiner as a scan does, and `sink` through them; events come unchanged.
/// Frames that were lost, gated or dropped have no pixels and are not fed: their events say so. A frame keeps its
/// recorded number, which counts what the disk dropped. `before(stamp)` is called in the order of the stamps, before
/// anything of that moment is fed.
/// Threads: one.
/// Errors: InputError of an unreadable image; what the sink throws.
ReplayCounts replay_scan(const Session& session, const RecordedScan& recorded, const ScanSettings& settings,
                         ScanSink& sink, const std::function<void(Stamp)>& before);

}  // namespace tankrig
