// Where the fixed camera stands to the arm, from a marker in the gripper: cMg(i) = cMb * bMe(i) * eMg, solved for cMb and eMg
// together.
//
// Every closed form of ViSP and OpenCV is kept beside the result. The result minimises the marker corners' reprojection error over
// all views, from the best of their answers. Zero offsets and links of the arm are refined where views that were held back are
// fitted better for it.
//
// Errors come from two places: corners in the image, and joints that stand elsewhere than they read. The first is measured within
// each view, the second between views; the covariance has both.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/estimate/estimate.hpp"
#include "core/arm_model.hpp"
#include "core/camera_model.hpp"

namespace tankrig {

/// What was seen with the arm at rest in one posture.
struct HandEyeView {
  std::string name;                       ///< of its picture or line, for messages
  std::vector<Vector3d> points;           ///< of the marker, in g [m]: those seen
  std::vector<Vector2d> corners;          ///< where they were seen [px]; none: only `cMg` is known
  Transform cMg = Transform::Identity();  ///< marker as seen alone
  std::optional<Transform> cMg_flipped;   ///< a flat marker's other pose that fits nearly as well
  std::optional<JointVector> q;           ///< by the encoders
  Transform bMe = Transform::Identity();  ///< by kinematics; used where there is no `q`
};

struct HandEyeProblem {
  std::optional<CameraModel> camera;  ///< without one, views have no corners
  ArmModel arm;                       ///< as given
  Vector3d target_c{0, 0, 1};         ///< where the effects on the target are computed, in c [m]
  bool refine_arm = true;             ///< offsets and links of the arm too, where the data supports it
  bool refine_links = true;           ///< false: offsets at most
  std::vector<HandEyeView> views;
};

/// One closed form's answer.
struct HandEyeMethod {
  std::string name;
  std::string failure;  ///< why it is none; empty: it is one
  Transform cMb = Transform::Identity(), eMg = Transform::Identity();
  double rms = 0;        ///< of the views that count, in the unit of HandEyeSolution::rms
  double rotation = 0;   ///< from the refined cMb [rad]
  double at_target = 0;  ///< from where the refined cMb puts the target [m]
};

/// How well a set of freedoms of the arm predicts views that were held back.
struct ArmChoice {
  std::string name;  ///< "as given", "shoulder and elbow zero", "zero offsets and links"
  double held_back_rms = 0;
  bool taken = false;
};

struct HandEyeSolution {
  Transform cMb = Transform::Identity(), eMg = Transform::Identity();
  ArmModel arm;  ///< with what was refined
  std::vector<Estimate>
      parameters;              ///< cMb and eMg about and along the axes of c and e, then what was refined of the arm
  Eigen::MatrixXd covariance;  ///< of `parameters`
  double target_sigma = 0;     ///< of the target's place by all of them [m]
  bool pixels = true;          ///< the unit of what follows: px, or m without corners
  double rms = 0;              ///< per marker point, over the views that count
  double corner_sigma =
      0;                   ///< of one coordinate of a corner, from within the views; of poses alone, of their place [m]
  double joint_sigma = 0;  ///< what joints err by from view to view [rad]; bMe: rad and m; poses alone: their rotation
  double degrees_of_freedom = 0;
  std::vector<double> view_rms;       ///< of every view
  std::vector<std::size_t> outliers;  ///< views that fit none of it
  std::vector<std::size_t> flipped;   ///< views whose other pose was the right one
  std::vector<HandEyeMethod> methods;
  std::string start;  ///< the method it was refined from
  std::vector<ArmChoice> choices;
  std::string decision;  ///< why that choice, with the figure
};

/// Threads: any. Same input, same bits.
/// Errors: InputError with what was found and what to record instead: too few views, a joint that hardly moves, joints that do not
/// belong to the pictures, views that leave a number open.
HandEyeSolution solve(const HandEyeProblem& problem);

/// What the set fails to excite, in one sentence; empty: nothing.
std::string missing_excitation(const std::vector<HandEyeView>& views);

}  // namespace tankrig
