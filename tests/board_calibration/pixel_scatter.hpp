// How far found cameras put a point off its true pixel, beside what they say of themselves.
#pragma once

#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>

#include "calibration/intrinsics/intrinsics.hpp"
#include "calibration/intrinsics/projection_uncertainty.hpp"
#include "tests/board_calibration/generated_boards.hpp"

namespace tankrig {

/// Where a point at rest with the targets appears [px], in the worst direction.
struct PixelScatter {
  double worst = 0;  ///< root mean square off the truth
  double told = 0;   ///< mean of what each found camera says of itself
};

/// Of the point 0.5 m along the line of sight of `pixel`, by cameras found from targets at `cMts` whose corners are
/// `noise_px` off. The targets tell where a found camera is. Prints its seeds.
inline PixelScatter scatter_of(const CameraModel& truth, const Vector2d& pixel, const BoardTarget& target,
                               const std::vector<Transform>& cMts, double noise_px, int seeds,
                               const std::function<IntrinsicsProblem()>& problem_of) {
  const Vector3d p = truth.sight(pixel.x(), pixel.y()).at(0.5);
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  PixelScatter out;
  for (int seed = 1; seed <= seeds; ++seed) {
    std::mt19937_64 random(static_cast<std::uint64_t>(100 + seed));
    IntrinsicsProblem problem = problem_of();
    for (const Transform& cMt : cMts)
      problem.pictures.push_back(
          {std::to_string(problem.pictures.size()), corners_of(truth, target, cMt, noise_px, random)});
    const IntrinsicsSolution s = solve(problem);
    Vector3d in_found = Vector3d::Zero();
    for (std::size_t v = 0; v < cMts.size(); ++v)
      in_found += s.bundle.cMt[v] * (cMts[v].inverse() * p) / double(cMts.size());
    const Vector2d error = s.camera.project(in_found).value() - pixel;
    scatter += error * error.transpose() / seeds;
    out.told += ProjectionUncertainty(s).at(pixel, 0.5)->independent_px / seeds;
  }
  out.worst = std::sqrt(scatter.eigenvalues().real().maxCoeff());
  std::printf("seeds 101 to %d: scatter %.4f px, told %.4f px\n", 100 + seeds, out.worst, out.told);
  return out;
}

}  // namespace tankrig
