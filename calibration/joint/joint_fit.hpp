// The joint problem solved: every group of measurements weighed by what it errs, stripes that are none left out.
#pragma once

#include "calibration/joint/joint_normal.hpp"

namespace tankrig {

struct JointFit {
  /// Keeps a reference to the problem.
  /// Errors: InputError without a minimum, or with a number that the data leaves open.
  explicit JointFit(const JointProblem& problem);

  const JointProblem& problem;
  PlaneFrame frame;
  JointState state;
  std::vector<ErrorGroup> groups;
  JointGroups at;
  std::vector<std::vector<bool>> strays;  ///< stripes that are left out, board by board
  JointLinear linear;
  JointNormal normal;

  /// Where `numbers` have the laser's plane.
  Plane plane(const JointState& numbers) const;
  /// How far a stripe's places lie from the laser's plane [m].
  std::array<double, 2> distances(std::size_t sheet, const BoardStripe& stripe) const;
  /// A group's residuals of stripes, board by board.
  std::vector<std::vector<double>> rows_of(std::size_t group, const Eigen::VectorXd& residuals) const;

 private:
  void weigh();
  void find_strays();
};

/// Variance of a mean of many in a row over that of as many independent ones, from how they go together within each row.
double serial_allowance(const std::vector<std::vector<double>>& rows);

/// How well the delay is known. The elbow errs alike from frame to frame, and other numbers take none of that from the difference of
/// both directions: so what the stripes say of it varies by the slowest waves along the sweep, as in time_offset.cpp.
struct DelaySpread {
  double sigma = 0;    ///< [s]
  double freedom = 0;  ///< degrees of it
};
DelaySpread delay_spread(const JointFit& fit);

/// Moves that would make the measurements agree better, the worst first.
std::vector<Discrepancy> discrepancies_of(const JointFit& fit);

JointSolution solution_of(const JointFit& fit);

}  // namespace tankrig
