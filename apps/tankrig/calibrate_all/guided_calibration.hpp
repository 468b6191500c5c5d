// The steps of `calibrate all`. Each records what it needs, unless that was recorded already, and adds its part.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/tankrig/calibrate/calibration_part.hpp"
#include "apps/tankrig/calibrate/intrinsics_json.hpp"
#include "apps/tankrig/calibrate/targets.hpp"
#include "apps/tankrig/calibrate_all/joint_step.hpp"
#include "apps/tankrig/calibrate_all/live_pictures.hpp"
#include "apps/tankrig/calibrate_all/session_problems.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/scan/ready_rig.hpp"
#include "core/calibration_file.hpp"

namespace tankrig::app {

/// In the calibration's folder: what the steps wrote so far, and what a run that got to its end left.
inline constexpr char kUnfinishedCalibration[] = "unfinished.yaml", kCalibration[] = "calibration.yaml";

struct GuidedOptions {
  ScanOptions scan;              ///< rig, world, carrier, operator, waivers
  std::filesystem::path folder;  ///< recordings, corners.yaml, calibration.yaml, report
  double click_sigma = 1;        ///< of the simulated operator [px]
  PortOptions port;              ///< before every camera; its `in_air` is a calibration.yaml
};

/// The steps in their order; each starts from what those before have found, and from the rig file's values, never from an
/// earlier calibration: the same recordings give the same numbers.
class GuidedCalibration {
 public:
  /// Errors: InputError if the rig file has no `targets`.
  GuidedCalibration(const GuidedOptions& options, Progress& progress);

  void boards();  ///< lenses, the right eye in the left one, the left one in the mono camera
  void marker();  ///< the mono camera in the arm's base, with the arm's zeros
  void sweep();   ///< the mono camera's delay
  void sheet();   ///< the laser's plane in the end effector
  void joint();   ///< all of these at once, if what was held back is none the worse for it
  /// The object in the arm's base. False: its corners are still to be clicked.
  bool object();
  /// Writes calibration.yaml: accepted if every figure on data that was held back is within its limit.
  Calibration judge();

  /// Where the clicks put the object before they are snapped.
  const Transform& bMo_clicked() const { return bMo_clicked_; }
  const std::filesystem::path& file() const { return file_; }
  const JointOutcome& joint_outcome() const { return joint_outcome_; }

 private:
  using Seen = std::vector<std::optional<BoardPicture>>;
  struct SharedBoards {
    std::vector<BoardPair> used, kept;  ///< kept: held back
  };
  /// By camera, then by moment; nothing where a picture does not count. Sessions are recorded until enough of them do; all that
  /// an earlier run has recorded counts, even where it was stopped.
  /// Errors: InputError with what is missing, if a session brought nothing.
  std::vector<Seen> boards_that_count(const std::vector<const RigCamera*>& cameras);
  static SharedBoards shared(const Seen& a, const Seen& b);
  IntrinsicsSolution lens_of(const RigCamera& camera, const Seen& seen) const;
  /// A flat port that may be before the camera: the options' or the rig file's.
  std::optional<FlatPort> port_of(const RigCamera& camera) const;
  /// The camera's lens in air; nothing: not given.
  /// Errors: InputError if the calibration given has none of this size.
  std::optional<CameraModel> in_air(const RigCamera& camera) const;

  /// `judge`: of the pictures, as they come.
  OpenedSession session(const std::string& name, const std::string& scene_board, const std::string& ask,
                        const std::function<ReadyRig::PlanFrom(RigConfig&)>& prepare,
                        const std::optional<PictureJudge>& judge = {});
  void compare_with_stereo(const RigConfig& rig, Duration time_offset, const LaserPlaneSolution& by_boards);

  const GuidedOptions& options_;
  Progress& progress_;
  const std::filesystem::path file_;  ///< calibration.yaml
  const WriteOptions write_;          ///< what it is until it is judged
  const CalibrationTargets targets_;
  std::vector<CalibrationCheck> checks_;
  CalibratedPose left_in_mono_;
  CalibrationSource boards_source_;
  JointStep joint_;
  JointOutcome joint_outcome_;
  Transform bMo_clicked_ = Transform::Identity();
};

}  // namespace tankrig::app
