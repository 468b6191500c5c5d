// A stripe on a flat board as a straight line: hundreds of points that err alike say no more than its place and its direction.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "calibration/joint/joint.hpp"
#include "core/median.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kLeastOfStripe = 12;
constexpr double kOffLine = 3.5;       // robust standard deviations from the line
constexpr double kLeastSpread = 0.01;  // root mean square along the stripe [m]
constexpr int kLineRounds = 4;

struct BoardPoint {
  Vector2d t;
  double weight = 0;
};

/// Weighted, of those in use.
struct Line {
  Vector2d middle = Vector2d::Zero(), along = Vector2d::UnitX();
  double spread = 0;

  double off(const Vector2d& t) const { return along.x() * (t - middle).y() - along.y() * (t - middle).x(); }
};

Line line_of(const std::vector<BoardPoint>& points, const std::vector<bool>& use) {
  Line line;
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (use[i]) line.middle += points[i].weight * points[i].t, sum += points[i].weight;
  line.middle /= sum;
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector2d d = points[i].t - line.middle;
    if (use[i]) scatter += points[i].weight / sum * d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(scatter);
  line.along = eigen.eigenvectors().col(1);
  line.spread = std::sqrt(eigen.eigenvalues()[1]);
  return line;
}

}  // namespace

std::optional<BoardStripe> board_stripe(const CameraModel& camera, const Transform& cMt,
                                        const std::vector<PlacedStripePoint>& points, const JointVector& q,
                                        const JointVector& velocity) {
  if (points.size() < kLeastOfStripe) return std::nullopt;
  const Transform tMc = cMt.inverse();
  std::vector<double> sigmas;
  for (const PlacedStripePoint& point : points) sigmas.push_back(point.sigma);
  const double typical = upper_median(sigmas);
  std::vector<BoardPoint> on_board;
  for (const PlacedStripePoint& point : points)
    on_board.push_back({(tMc * point.p).head<2>(), 1 / (typical * typical + point.sigma * point.sigma)});
  // Around its own line: what lies off the laser's plane is for all stripes together to say.
  std::vector<bool> use(points.size(), true);
  Line line = line_of(on_board, use);
  for (int round = 0; round < kLineRounds; ++round) {
    std::vector<double> off;
    for (const BoardPoint& point : on_board) off.push_back(std::abs(line.off(point.t)));
    const double most = kOffLine * 1.4826 * upper_median(off);
    std::size_t left = 0;
    for (std::size_t i = 0; i < use.size(); ++i) left += use[i] = std::abs(line.off(on_board[i].t)) <= most;
    if (left < kLeastOfStripe) return std::nullopt;
    line = line_of(on_board, use);
  }
  if (line.spread < kLeastSpread) return std::nullopt;
  BoardStripe stripe{q, velocity, {}};
  for (const int side : {0, 1}) {
    const Vector2d t = line.middle + (side ? line.spread : -line.spread) * line.along;
    const auto pixel = camera.project(cMt * Vector3d(t.x(), t.y(), 0));
    if (!pixel) return std::nullopt;
    stripe.pixels[static_cast<std::size_t>(side)] = *pixel;
  }
  return stripe;
}

}  // namespace tankrig
