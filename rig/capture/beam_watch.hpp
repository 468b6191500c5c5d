// What the cameras say of the laser: the stripe is there when the device says on, and gone when it says off.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/camera.hpp"
#include "rig/capture/laser_timeline.hpp"
#include "rig/executive/cycle_record.hpp"
#include "rig/safety/beam_check.hpp"
#include "rig/safety/laser_interlock.hpp"
#include "rig/safety/safety_settings.hpp"
#include "rig/sync/joint_history.hpp"

namespace tankrig {

/// Whether a camera should see the stripe with the arm in this posture. Empty: unknown; then a missing stripe says
/// nothing.
using StripeInView = std::function<bool(const JointVector& q)>;

/// Each camera learns the dark from its first frames before any light, however few. From then on every frame testifies,
/// except around a switching. `frames` contradictions of one camera in a row are a verdict, and it stays. A camera
/// whose lit picture stays the same, bit for bit, while the arm moves is no witness.
/// Threads: one, the supervisor's.
/// RT: never.
class BeamWatch {
 public:
  /// No frame testifies for `settle` before and after a switching. `laser` and `joints` outlive it.
  BeamWatch(const BeamSettings& settings, Duration settle, const LaserTimeline& laser, const JointHistory& joints)
      : settings_(settings), settle_(settle), laser_(laser), joints_(joints) {}

  /// Cameras are numbered in the order they are added. A waived one is ignored.
  void add_camera(const std::string& name, StripeInView in_view);
  /// In order of their stamps.
  void add(const CycleRecord& record);
  void add(int camera, const Frame& frame);

  /// Judges the frames whose light is known by now; lit ones also need their joints.
  BeamVerdict judge();

  /// The camera that has repeated its lit picture in `frames` frames in a row.
  std::optional<int> repeating() const { return repeating_; }
  /// A camera without a dark picture before the light: it cannot testify.
  std::optional<int> blind() const { return blind_; }

  /// "beam seen in 200 of 200 lit frames, not seen in 24 of 24 dark ones; waived: mono"
  std::string summary() const;

 private:
  struct PerCamera {
    bool testifies = false;
    StripeInView in_view;
    DarkReference dark;
    double lit_contrast = 0;     // of the newest stripe seen with the laser on
    int missing = 0, stray = 0;  // in a row
    cv::Mat lit;                 // the newest picture with a stripe, and the joints when it was new
    JointVector lit_q = JointVector::Zero();
    int repeated = 0;  // in a row
  };
  struct Waiting {
    int camera;
    Stamp begin, middle, end;
    cv::Mat image;
  };

  bool joints_known(const Waiting& frame) const;
  void judge_lit(PerCamera& camera, const Waiting& frame);
  void judge_repeats(PerCamera& camera, const Waiting& frame, const JointVector& q);
  void judge_dark(PerCamera& camera, const Waiting& frame);

  const BeamSettings settings_;
  const Duration settle_;
  const LaserTimeline& laser_;
  const JointHistory& joints_;
  std::vector<PerCamera> cameras_;
  std::deque<Waiting> waiting_;
  std::optional<Stamp> switched_;  // newest switching, commanded or told
  bool commanded_ = false, emitting_ = false, was_lit_ = false;
  BeamVerdict verdict_ = BeamVerdict::kNone;
  std::optional<int> repeating_, blind_;
  int lit_ = 0, lit_seen_ = 0, dark_ = 0, dark_clear_ = 0;
};

}  // namespace tankrig
