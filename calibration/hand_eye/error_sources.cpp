#include "calibration/hand_eye/error_sources.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace tankrig {
namespace {

constexpr double kLeastCorner = 1e-9;                   // of exact data: px or m
constexpr double kLeastJoint = 1e-8, kMostJoint = 0.2;  // where the joints' is looked for [rad]

std::vector<Eigen::MatrixXd> whitening(const std::vector<ViewErrors>& views, double corner, double joint) {
  std::vector<Eigen::MatrixXd> out;
  for (const ViewErrors& v : views) {
    const Eigen::Index size = v.residuals.size();
    const Eigen::MatrixXd covariance =
        corner * corner * Eigen::MatrixXd::Identity(size, size) + joint * joint * v.by_view * v.by_view.transpose();
    out.push_back(covariance.llt().matrixL().solve(Eigen::MatrixXd::Identity(size, size)));
  }
  return out;
}

/// Sum of whitened squares at the solution that this whitening has, to first order.
double squares(const std::vector<ViewErrors>& views, const std::vector<Eigen::MatrixXd>& whiten) {
  const Whitened all = whitened(views, whiten);
  return (all.residuals - all.jacobian * all.jacobian.colPivHouseholderQr().solve(all.residuals)).squaredNorm();
}

/// Poses without corners: their points move as one, so nothing is left within a view. A pose errs in its place and, by another
/// measure, in its rotation about its points' middle.
ErrorSources of_poses(const std::vector<ViewErrors>& views, double freedom) {
  std::vector<Eigen::MatrixXd> places, turns;
  double place_squares = 0, turn_squares = 0;
  for (const ViewErrors& v : views) {
    const Eigen::MatrixXd shift = v.by_state.middleCols(3, 3);
    const Eigen::MatrixXd to_shift =
        shift.colPivHouseholderQr().solve(Eigen::MatrixXd::Identity(shift.rows(), shift.rows()));
    const Eigen::MatrixXd turn = v.by_state.leftCols(3) - shift * to_shift * v.by_state.leftCols(3);
    places.push_back(to_shift);
    turns.push_back(turn.colPivHouseholderQr().solve(Eigen::MatrixXd::Identity(turn.rows(), turn.rows())));
    place_squares += (places.back() * v.residuals).squaredNorm();
    turn_squares += (turns.back() * v.residuals).squaredNorm();
  }
  ErrorSources out;
  out.degrees_of_freedom = freedom;
  out.corner = std::max(kLeastCorner, std::sqrt(2 * place_squares / freedom));
  out.joint = std::max(kLeastCorner, std::sqrt(2 * turn_squares / freedom));
  for (std::size_t k = 0; k < views.size(); ++k) {
    out.whiten.push_back(Eigen::MatrixXd::Zero(places[k].cols(), places[k].cols()));
    out.whiten.back().topRows(3) = places[k] / out.corner;
    out.whiten.back().middleRows(3, 3) = turns[k] / out.joint;
  }
  return out;
}

}  // namespace

Whitened whitened(const std::vector<ViewErrors>& views, const std::vector<Eigen::MatrixXd>& whiten) {
  Eigen::Index rows = 0;
  for (const ViewErrors& v : views) rows += v.residuals.size();
  Whitened out{Eigen::VectorXd(rows), Eigen::MatrixXd(rows, views[0].by_state.cols())};
  Eigen::Index row = 0;
  for (std::size_t k = 0; k < views.size(); ++k) {
    const Eigen::Index size = views[k].residuals.size();
    out.residuals.segment(row, size) = whiten[k] * views[k].residuals;
    out.jacobian.middleRows(row, size) = whiten[k] * views[k].by_state;
    row += size;
  }
  return out;
}

ErrorSources error_sources(const std::vector<ViewErrors>& views, bool poses_alone) {
  const double numbers = static_cast<double>(views[0].by_state.cols());
  double within = 0, within_freedom = 0, all = 0, total_freedom = -numbers;
  for (const ViewErrors& v : views) {
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> joints(v.by_view);
    within += (v.residuals - v.by_view * joints.solve(v.residuals)).squaredNorm();
    within_freedom += static_cast<double>(v.residuals.size() - joints.rank());
    all += v.residuals.squaredNorm();
    total_freedom += static_cast<double>(v.residuals.size());
  }
  const double between_freedom = kPoseStep * static_cast<double>(views.size()) - numbers;
  ErrorSources out;
  out.degrees_of_freedom = total_freedom;
  if (poses_alone) return of_poses(views, between_freedom);
  out.corner = std::max(kLeastCorner, std::sqrt(within / within_freedom));
  if (squares(views, whitening(views, out.corner, 0)) > total_freedom) {
    double low = std::log(kLeastJoint), high = std::log(kMostJoint);
    for (int step = 0; step < 50; ++step) {
      const double middle = (low + high) / 2;
      const bool too_small = squares(views, whitening(views, out.corner, std::exp(middle))) > total_freedom;
      (too_small ? low : high) = middle;
    }
    out.joint = std::exp((low + high) / 2);
    out.degrees_of_freedom = between_freedom;
  } else {
    out.corner = std::max(kLeastCorner, std::sqrt(all / total_freedom));
  }
  out.whiten = whitening(views, out.corner, out.joint);
  return out;
}

}  // namespace tankrig
