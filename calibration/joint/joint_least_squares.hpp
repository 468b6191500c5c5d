// The joint problem as least squares: where everything stands, how its measurements are weighed, what is left of them.
#pragma once

#include <ceres/problem.h>

#include <functional>

#include "calibration/joint/joint_errors.hpp"

namespace tankrig {

struct JointState {
  std::vector<CameraParameters> lenses;
  std::vector<PortParameters> ports;  ///< camera by camera; of no meaning without a port
  std::vector<PoseNumbers> kMc, views, sheets;
  std::array<double, 2> bend{};
  PoseNumbers cMb{}, eMg{};
  std::array<double, 4> zeros{};              ///< beyond those of JointProblem::arm
  std::array<double, 3> plane{};              ///< as PlaneFrame has it
  double delay = 0;                           ///< of camera 0's stamps, beyond what they were corrected by [s]
  std::array<double, 2> sweep{};              ///< by how much slew and shoulder stand beyond what they read, all along
  std::vector<std::array<double, 4>> joints;  ///< likewise all four, posture by posture
};

inline constexpr double kWidth = 1.96;  ///< of 95 % intervals, in sigmas

/// What is measured, in groups that err alike. With K cameras: boards by camera, markers by camera, then these.
struct JointGroups {
  std::size_t cameras = 0;

  std::size_t boards(std::size_t camera) const { return camera; }
  std::size_t marker(std::size_t camera) const { return cameras + camera; }
  std::size_t joints() const { return 2 * cameras; }
  std::size_t corners() const { return 2 * cameras + 1; }
  std::size_t offset() const { return 2 * cameras + 2; }
  std::size_t slope() const { return 2 * cameras + 3; }
  std::size_t size() const { return 2 * cameras + 4; }
};

/// One number of the state that is looked for.
struct JointColumn {
  enum Of { kRig, kSweep, kPicture };  ///< kPicture: of one picture, or of one posture

  std::string name, unit;
  Of of = kRig;
  std::function<double*(JointState&)> block;
  int at = 0;  ///< in the block

  double& in(JointState& state) const { return block(state)[at]; }
};
inline constexpr std::array<const char*, 3> kPlaneNames{"laser tilt u", "laser tilt v", "laser distance"};

/// Around a solution.
struct JointLinear {
  Eigen::VectorXd residuals;  ///< whitened
  std::vector<int> group;     ///< of each; -1: none
  std::vector<int> rows, columns;
  std::vector<double> values;        ///< compressed rows of derivatives
  std::vector<JointColumn> numbers;  ///< of the first columns; then six of each knock
  std::vector<std::string> knocks;

  double dot(int row, const Eigen::MatrixXd& between) const;  ///< of a row's first columns with itself
};

/// Camera k with the numbers of `state`.
RationalCamera camera_at(const JointProblem& problem, const JointState& state, std::size_t k);

/// Where the ray of a pixel meets the board's plane.
/// Frames: t.
Vector2d on_board(const CameraModel& camera, const Transform& cMt, const Vector2d& pixel);

class JointLeastSquares {
 public:
  /// Keeps references to all of them; moves `state`. `strays`: stripes that are left out, board by board.
  JointLeastSquares(const JointProblem& problem, const PlaneFrame& frame, const std::vector<ErrorGroup>& groups,
                    const std::vector<std::vector<bool>>& strays, JointState& state);

  /// Errors: InputError without a minimum.
  void solve();
  JointLinear linear();

 private:
  void add_boards();
  void add_marker();
  void add_sheets();
  void hold_what_is_not_free();
  std::vector<int> free_of_lens() const;
  void add(ceres::CostFunction* cost, std::vector<double*> blocks, const std::vector<std::size_t>& groups);
  double weight(std::size_t group) const { return 1 / (groups_[group].sigma * groups_[group].allowance); }

  const JointProblem& problem_;
  const PlaneFrame& frame_;
  const std::vector<ErrorGroup>& groups_;
  const std::vector<std::vector<bool>>& strays_;
  JointState& state_;
  JointGroups at_;
  std::vector<std::array<double, 6>> knocks_;  ///< of cMb between marker and stripe; of kMc between boards and marker
  std::array<double, 6> no_knock_{};           ///< of camera 0 between boards and marker: cMb takes it up
  std::array<double, 2> no_bend_{};            ///< of boards under the sweep
  std::vector<int> group_of_row_;
  ceres::Problem ceres_;
};

}  // namespace tankrig
