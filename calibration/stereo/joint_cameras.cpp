#include "calibration/stereo/joint_cameras.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "calibration/estimate/rotation_vector.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr double kFarWorse = 4;   // a board's error over the median of all boards'
constexpr double kCauchy_px = 1;  // a board of another moment must not pull the others along
constexpr std::size_t kCornersForAPose = 6;

bool is_seen(const FoundBoard& board) { return board.ids.size() >= kCornersForAPose; }

/// Where each view's target is, by the first camera that tells; views of none go.
void place_views(BoardBundle& bundle) {
  const std::vector<Vector3d> points = bundle.target.points();
  std::vector<BoardView> placed;
  bundle.cMt.clear();
  for (BoardView& view : bundle.views)
    for (std::size_t k = 0; k < view.seen.size(); ++k) {
      const auto pose = is_seen(view.seen[k]) ? board_pose(bundle.cameras[k], points, view.seen[k]) : std::nullopt;
      if (!pose) continue;
      bundle.cMt.push_back(bundle.kMc[k].inverse() * pose->cMt);
      placed.push_back(std::move(view));
      break;
    }
  bundle.views = std::move(placed);
}

/// The board that fits worst is taken out of its view, if it fits far worse than most. False if none does.
bool leave_out_worst(BoardBundle& bundle, const std::vector<CornerResidual>& residuals,
                     std::vector<std::string>& left_out) {
  struct Board {
    double squares = 0;
    std::size_t corners = 0, view = 0, camera = 0;

    double rms() const { return std::sqrt(squares / static_cast<double>(corners)); }
  };
  std::vector<Board> boards;  // residuals come board by board
  for (const CornerResidual& r : residuals) {
    const auto camera = static_cast<std::size_t>(r.camera);
    if (boards.empty() || boards.back().view != r.view || boards.back().camera != camera)
      boards.push_back({0, 0, r.view, camera});
    boards.back().squares += r.error.squaredNorm(), ++boards.back().corners;
  }
  std::sort(boards.begin(), boards.end(), [](const Board& a, const Board& b) { return a.rms() < b.rms(); });
  const double median = boards[boards.size() / 2].rms();
  const Board& worst = boards.back();
  if (!(worst.rms() > kFarWorse * median)) return false;
  BoardView& view = bundle.views[worst.view];
  left_out.push_back(
      fmt::format("{}, camera {}: {:.2f} px beside the others' {:.2f}", view.name, worst.camera, worst.rms(), median));
  view.seen[worst.camera] = {};
  if (std::none_of(view.seen.begin(), view.seen.end(), is_seen)) {
    bundle.views.erase(bundle.views.begin() + static_cast<std::ptrdiff_t>(worst.view));
    bundle.cMt.erase(bundle.cMt.begin() + static_cast<std::ptrdiff_t>(worst.view));
  }
  return true;
}

}  // namespace

JointCameras refine_together(BoardBundle start) {
  if (start.target.turns().size() > 1)
    throw InputError("the target looks the same when turned, expected a ChArUco board, or an odd and an even side");
  JointCameras out;
  place_views(start);
  BundleFit fit;
  do {
    if (start.views.empty()) throw InputError("no camera saw the target well enough, expected boards of every camera");
    fit = solve(start, kCauchy_px);
    if (!fit.converged) throw InputError("the cameras do not converge together on these boards");
  } while (leave_out_worst(start, fit.residuals, out.left_out));
  fit = solve(start);
  out.rms = rms(fit.residuals);
  const BundleCovariance joint = covariance(start);
  const ResidualNoise noise = noise_of(start, fit.residuals, joint.layout.size);
  check_observable(start, joint, noise);
  const double sigma = noise.sigma * noise.allowance;
  for (std::size_t k = 0; k < start.cameras.size(); ++k) {
    if (!start.cameras[k].invertible())
      throw InputError("the distortion found folds over within the image: ask for a simpler lens model");
    CameraParameters& of = out.sigma.emplace_back();
    of.fill(0);
    for (std::size_t i = 0; i < of.size(); ++i)
      if (const int at = joint.layout.cameras[k][i]; at >= 0) of[i] = sigma * std::sqrt(joint.matrix(at, at));
    std::vector<double>& of_port = out.port_sigma.emplace_back();
    if (const int at = joint.layout.ports[k]; at >= 0)
      for (int i = at; i < at + kPortParameters; ++i) of_port.push_back(sigma * std::sqrt(joint.matrix(i, i)));
    Eigen::Matrix<double, 6, 6>& covariance = out.covariance.emplace_back();
    covariance.setZero();
    if (const int at = joint.layout.relative[k]; at >= 0) {
      const Eigen::AngleAxisd turn(start.kMc[k].rotation());
      Eigen::Matrix<double, 6, 6> step = Eigen::Matrix<double, 6, 6>::Identity();
      step.topLeftCorner<3, 3>() = left_jacobian(turn.angle() * turn.axis());
      covariance = sigma * sigma * step * joint.matrix.block<6, 6>(at, at) * step.transpose();
    }
  }
  out.bundle = std::move(start);
  return out;
}

}  // namespace tankrig
