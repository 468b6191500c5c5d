// Where a hand-eye set errs, told apart: corners within a view, joints from view to view.
#pragma once

#include <vector>

#include "calibration/hand_eye/marker_error.hpp"

namespace tankrig {

struct ErrorSources {
  double corner = 0;  ///< standard deviation of a corner's coordinate [px]; of poses alone, of their place [m]
  double joint = 0;   ///< of a joint, or a step of bMe [rad, m]; of poses alone, of their rotation [rad]
  double degrees_of_freedom = 0;        ///< behind them
  std::vector<Eigen::MatrixXd> whiten;  ///< of each view
};

/// All views' residuals and their derivatives by the state, one below the other.
struct Whitened {
  Eigen::VectorXd residuals;
  Eigen::MatrixXd jacobian;
};
Whitened whitened(const std::vector<ViewErrors>& views, const std::vector<Eigen::MatrixXd>& whiten);

/// The corners' scatter is what no motion of the joints explains. What views differ by beyond that is the joints': their
/// standard deviation is the one at which the sum of squares is what its degrees of freedom say (J. Mandel, R. C. Paule 1970).
/// `views` are at a least-squares solution; `poses_alone`: without corners.
ErrorSources error_sources(const std::vector<ViewErrors>& views, bool poses_alone);

}  // namespace tankrig
