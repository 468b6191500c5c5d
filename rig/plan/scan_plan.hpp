// The whole scan laid out in time before anything moves: moves, dark blocks, laser warm-up, sweep passes.
#pragma once

#include <string>
#include <vector>

#include "core/frame_record.hpp"
#include "rig/plan/motion_profile.hpp"
#include "rig/plan/scan_settings.hpp"

namespace tankrig {

/// One stretch of the plan. Times are seconds from the plan's start.
struct Segment {
  std::string name;  ///< for people: "dark block before", "sweep pass 1"
  Phase phase = Phase::kMove;
  int pass = 0;
  bool laser = false;     ///< laser requested
  bool sweeping = false;  ///< from the laser's warm-up to the end of the last pass: the safety step's `sweeping`
  bool hold = false;      ///< light with the arm at rest, as an operator asked for: the safety step's `hold`
  double begin = 0;
  double duration = 0;
  JointMove motion;         ///< a hold is a move of no distance
  double record_begin = 0;  ///< frames exposed within [record_begin, record_end] belong to `phase`;
  double record_end = 0;    ///<   empty for moves

  double end() const noexcept { return begin + duration; }
};

/// Frames: joint space.
/// Time 0 is on the frame grid: at every whole frame period, a frame of the sweep's camera is at mid-exposure.
class ScanPlan {
 public:
  explicit ScanPlan(std::vector<Segment> segments) : segments_(std::move(segments)) {}

  const std::vector<Segment>& segments() const noexcept { return segments_; }
  double duration() const noexcept { return segments_.back().end(); }
  bool uses_laser() const noexcept;
  /// The least and largest angle of every joint.
  /// RT: safe.
  std::array<JointLimit, kJoints> reach() const noexcept;
  /// Index of the segment at `t`; the first before the plan, the last after it.
  /// RT: safe.
  std::size_t segment_at(double t) const noexcept;
  /// Set-point at `t`; at rest before and after the plan.
  /// RT: safe.
  MotionPoint at(double t) const noexcept;
  /// How many frames a camera of this period will record.
  int expected_frames(RecordWhen record, double frame_period, int dark_frames) const;

 private:
  std::vector<Segment> segments_;
};

/// now -> start of the sweep -> dark block -> laser on, warm-up -> pass 0, 1, ... -> laser off -> dark block -> park.
///
/// Passes interleave: their starts are placed on the frame grid so that pass k's frames lie k / passes of a frame's
/// step beside pass 0's. Later passes alternate in direction (there_and_back), or return and repeat.
/// Errors: InputError naming the setting, its value and what was expected.
ScanPlan make_scan_plan(const ScanSettings& settings, const JointVector& now);

}  // namespace tankrig
