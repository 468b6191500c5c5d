#include "rig/scan/replay.hpp"

#include <limits>

#include "core/input_error.hpp"
#include "rig/capture/frame_joiner.hpp"
#include "rig/plan/plan_csv.hpp"
#include "session/recording/event_kinds.hpp"

namespace tankrig {
namespace {

constexpr double kLaserToldWithin = 1;  // [s]
constexpr Stamp kEndOfTime{std::numeric_limits<std::int64_t>::max()};

/// Gives frames the numbers they were recorded with, and counts.
class NumberedSink final : public ScanSink {
 public:
  NumberedSink(const Session& session, ScanSink& sink, ReplayCounts& counts) : sink_(sink), counts_(counts) {
    for (const FrameRecord& frame : session.frames) recorded_[{frame.camera, frame.stamp.ns}] = &frame;
  }

  void joints(const JointState& state) override {
    ++counts_.joints;
    sink_.joints(state);
  }
  void frame(const FrameRecord& record, const cv::Mat& image) override {
    ++counts_.frames;
    FrameRecord numbered = record;
    const FrameRecord& as_recorded = *recorded_.at({record.camera, record.stamp.ns});
    numbered.index = as_recorded.index;
    numbered.file = as_recorded.file;
    sink_.frame(numbered, image);
  }
  /// The joiner's own: the recorded ones are passed on instead.
  void event(Stamp, std::string_view, const std::string&) override {}

 private:
  ScanSink& sink_;
  ReplayCounts& counts_;
  std::map<std::pair<std::string, std::int64_t>, const FrameRecord*> recorded_;
};

class Replay {
 public:
  Replay(const Session& session, const RecordedScan& recorded, const ScanSettings& settings, ScanSink& sink)
      : session_(session),
        recorded_(recorded),
        sink_(sink),
        numbered_(session, sink, counts_),
        joints_(kJointSamples, from_seconds(settings.control.max_joint_gap)),
        joiner_(recorded.plan, settings, joints_, laser_, numbered_) {
    constexpr bool kEachInItsSegment = true;  // only recorded frames come
    for (const CalibratedCamera& camera : session.info.cameras)
      numbers_[camera.name] = joiner_.add_camera(camera.name, RecordWhen::kAll, kEachInItsSegment);
    joiner_.start(recorded.plan_zero);
    for (const SessionEvent& event : recorded.events)
      if (event.kind == event_kind::kLaser && (event.text == kLaserEmitting || event.text == kLaserDark))
        edges_.push_back(&event);
    laser_.add({}, told_);  // dark before it is ever told of
  }

  ReplayCounts run(const std::function<void(Stamp)>& before) {
    for (const JointState& state : recorded_.joints) {
      before(state.stamp);
      feed_events(state.stamp);
      tell_laser(state.stamp);
      joints_.push(state);
      numbered_.joints(state);
      feed_frames(state.stamp);
    }
    feed_events(kEndOfTime);
    tell_laser(kEndOfTime);
    feed_frames(kEndOfTime);
    joiner_.finish();
    for (const auto& [what, count] : joiner_.counts())
      if (!what.ends_with(".recorded")) counts_.refused[what] = count;
    return counts_;
  }

 private:
  void feed_events(Stamp now) {
    for (; event_ < recorded_.events.size() && recorded_.events[event_].stamp <= now; ++event_) {
      const SessionEvent& event = recorded_.events[event_];
      sink_.event(event.stamp, event.kind, event.text);
    }
  }

  /// A device tells of a change later than it was: by the time its frames came, the scan knew.
  void tell_laser(Stamp now) {
    for (; edge_ < edges_.size() && seconds(edges_[edge_]->stamp - now) < kLaserToldWithin; ++edge_) {
      told_.emitting = edges_[edge_]->text == kLaserEmitting;
      told_.since = edges_[edge_]->stamp;
      laser_.add(now, told_);
    }
    laser_.add(now, told_);
  }

  void feed_frames(Stamp now) {
    for (; frame_ < session_.frames.size() && session_.frames[frame_].stamp <= now; ++frame_) {
      const FrameRecord& record = session_.frames[frame_];
      const int camera = numbers_.at(record.camera);
      Frame frame;
      frame.image = session_.image(record);
      frame.stamp = record.stamp;
      frame.stamp_sigma = record.stamp_sigma;
      frame.exposure = record.exposure;
      frame.sequence = record.sequence;
      joiner_.add(camera, std::move(frame));
      joiner_.drain();
    }
    joiner_.drain();
  }

  const Session& session_;
  const RecordedScan& recorded_;
  ScanSink& sink_;
  ReplayCounts counts_;
  NumberedSink numbered_;
  JointHistory joints_;
  LaserTimeline laser_;
  FrameJoiner joiner_;
  std::map<std::string, int> numbers_;
  std::vector<const SessionEvent*> edges_;  // of the laser's light
  std::size_t event_ = 0, edge_ = 0, frame_ = 0;
  LaserState told_;
};

}  // namespace

std::string why_not_replayable(const Session& session) {
  if (session.info.kind == "import")
    return "is an import: others took its images, there are no joints and no laser to join them to";
  if (!std::filesystem::exists(session.path / "plan.csv"))
    return "was recorded without plan.csv: which frame belongs to which part of the scan is not known";
  return {};
}

RecordedScan read_recorded_scan(const Session& session) {
  RecordedScan scan{read_plan_csv(session.path / "plan.csv"),
                    {},
                    read_joints_csv(session.path / "joints.csv").records,
                    read_events_csv(session.path / "events.csv").records};
  for (const SessionEvent& event : scan.events)
    if (event.kind == event_kind::kPlan) {
      scan.plan_zero = event.stamp;
      return scan;
    }
  if (!session.frames.empty())
    throw InputError(session.path / "events.csv",
                     "found no event of kind " + std::string(event_kind::kPlan) + ", expected the plan's time 0");
  return scan;
}

ReplayCounts replay_scan(const Session& session, const RecordedScan& recorded, const ScanSettings& settings,
                         ScanSink& sink, const std::function<void(Stamp)>& before) {
  return Replay(session, recorded, settings, sink).run(before);
}

}  // namespace tankrig
