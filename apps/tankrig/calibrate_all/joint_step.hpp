// All steps' measurements at once, and whether what comes of it is taken: by the figures on what was held back.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/tankrig/calibrate/calibration_part.hpp"
#include "apps/tankrig/calibrate_all/held_back_checks.hpp"
#include "calibration/joint/joint.hpp"

namespace tankrig::app {

/// What the steps keep for it. Cameras are in the order mono, left, right.
struct JointStep {
  JointProblem problem;
  std::vector<std::filesystem::path> files;
  int views = 0;
  // Held back:
  std::vector<BoardPicture> mono_boards;
  std::vector<BoardPair> both_eyes, left_and_mono;
  std::vector<HandEyeView> marker;
  std::vector<SheetViews> ways_back;
};

/// One figure on what was held back, by the steps and by all together.
struct JointOutcome {
  bool taken = false;
  std::string why;                        ///< in words, with the figure that decides
  std::optional<CalibrationCheck> steps;  ///< the figure that decides, by the steps
  double joint = 0;                       ///< the same by all together
  std::optional<JointSolution> solution;  ///< nothing: there is none, and `why` says it
  std::vector<CalibrationCheck> checks;   ///< of what is taken
};

/// Solves, and puts the result into `part` if it is taken; else part and `checks`, the steps', stay. `folder`: of the recordings.
JointOutcome refine_jointly(const JointStep& step, const std::vector<CalibrationCheck>& checks,
                            const std::filesystem::path& folder, CalibrationPart& part);

/// "3.20 mm and 5.00 mrad".
std::string size_in_words(const Discrepancy::Size& size);

nlohmann::ordered_json joint_json(const JointOutcome& outcome);

}  // namespace tankrig::app
