#include "calibration/joint/joint_start.hpp"

#include <fmt/core.h>

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "core/angles.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kLeastPostures = 6, kLeastViews = 3, kLeastSheets = 2, kLeastStripes = 10;
constexpr double kLeastElbow_deg = 5;
constexpr double kFirstMarker_px = 0.3, kFirstJoint = 5e-4, kFirstStripe_px = 0.2;

}  // namespace

void check(const JointProblem& problem) {
  const std::size_t cameras = problem.boards.cameras.size();
  const auto refuse = [](const std::string& what) { throw InputError("joint refinement: " + what); };
  if (cameras == 0 || problem.boards.views.size() < kLeastViews ||
      problem.boards.cMt.size() != problem.boards.views.size())
    refuse(fmt::format("found {} boards, expected {} at least, with their places", problem.boards.views.size(),
                       kLeastViews));
  if (problem.cameras.size() != cameras)
    refuse(fmt::format("found {} cameras' names, expected {}", problem.cameras.size(), cameras));
  const auto check_elbow = [&](const char* where, const std::vector<double>& angles) {
    const auto [least, most] = std::minmax_element(angles.begin(), angles.end());
    if (const double span = to_degrees(*most - *least); span < kLeastElbow_deg)
      refuse(fmt::format("found an elbow that moves by {:.1f} deg {}, expected {:.0f} at least", span, where,
                         kLeastElbow_deg));
  };
  std::size_t seen = 0;
  std::vector<double> elbows;
  for (const MarkerPosture& posture : problem.postures) {
    if (posture.seen.size() != cameras)
      refuse(fmt::format("{}: found markers of {} cameras, expected {}", posture.name, posture.seen.size(), cameras));
    if (posture.seen[0].points.empty()) continue;
    ++seen;
    elbows.push_back(posture.q[kElbow]);
  }
  if (seen < kLeastPostures)
    refuse(fmt::format("{} sees the marker in {} postures, expected {} at least", problem.cameras[0], seen,
                       kLeastPostures));
  check_elbow("from posture to posture", elbows);
  if (problem.sheets.size() < kLeastSheets)
    refuse(fmt::format("found {} boards under the stripe, expected {} at least: before the object and behind it",
                       problem.sheets.size(), kLeastSheets));
  elbows.clear();
  for (const SheetBoard& sheet : problem.sheets) {
    if (sheet.corners.size() != sheet.points.size() || sheet.corners.size() < 4)
      refuse(fmt::format("{}: found {} corners of {}, expected all", sheet.name, sheet.corners.size(),
                         sheet.points.size()));
    if (sheet.stripes.size() < kLeastStripes)
      refuse(
          fmt::format("{}: found {} stripes, expected {} at least", sheet.name, sheet.stripes.size(), kLeastStripes));
    for (const BoardStripe& stripe : sheet.stripes) elbows.push_back(stripe.q[kElbow]);
  }
  check_elbow("from stripe to stripe", elbows);
  if (problem.delay && !(problem.delay->half_width > 0))
    refuse(fmt::format("found a delay known to {:g} s, expected more than 0", problem.delay->half_width));
}

PlaneFrame plane_frame(const JointProblem& problem) {
  std::vector<Vector3d> points;
  PlaneFrame frame;
  frame.normal = problem.ePl.normal;
  frame.centre.setZero();
  for (const SheetBoard& sheet : problem.sheets)
    for (const BoardStripe& stripe : sheet.stripes)
      for (const Vector2d& pixel : stripe.pixels) {
        const Vector2d t = on_board(problem.boards.cameras[0], sheet.cMt, pixel);
        points.push_back((problem.cMb * problem.arm.bMe(stripe.q)).inverse() * sheet.cMt * Vector3d(t.x(), t.y(), 0));
        frame.centre += points.back();
      }
  frame.centre /= static_cast<double>(points.size());
  frame.centre -= problem.ePl.distance(frame.centre) * frame.normal;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Vector3d& p : points) {
    const Vector3d d = p - frame.centre, in_plane = d - frame.normal.dot(d) * frame.normal;
    scatter += in_plane * in_plane.transpose();
  }
  frame.v = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(2);
  frame.v = (frame.v - frame.normal.dot(frame.v) * frame.normal).normalized();
  frame.u = frame.v.cross(frame.normal);
  return frame;
}

JointState first_state(const JointProblem& problem) {
  JointState state;
  for (const RationalCamera& camera : problem.boards.cameras) {
    state.lenses.push_back(parameters_of(camera));
    state.ports.push_back(parameters_of(camera.port.value_or(FlatPort())));
  }
  for (const Transform& kMc : problem.boards.kMc) state.kMc.push_back(numbers_of(kMc));
  for (const Transform& cMt : problem.boards.cMt) state.views.push_back(numbers_of(cMt));
  for (const SheetBoard& sheet : problem.sheets) state.sheets.push_back(numbers_of(sheet.cMt));
  state.bend = {problem.boards.bend.x(), problem.boards.bend.y()};
  state.cMb = numbers_of(problem.cMb);
  state.eMg = numbers_of(problem.eMg);
  state.joints.assign(problem.postures.size(), {});
  return state;
}

std::vector<ErrorGroup> first_groups(const JointProblem& problem) {
  BoardBundle boards = problem.boards;
  const BundleFit fit = solve(boards);
  const ResidualNoise noise =
      noise_of(boards, fit.residuals, static_cast<int>(6 * boards.views.size() + 12 * boards.cameras.size()));
  const double corner = std::max(kLeast_px, noise.sigma);
  std::vector<ErrorGroup> groups;
  for (const std::string& camera : problem.cameras)
    groups.push_back({"corners of boards, " + camera, "px", 0, corner, noise.allowance});
  for (const std::string& camera : problem.cameras)
    groups.push_back({"corners of the marker, " + camera, "px", 0, kFirstMarker_px, 1});
  groups.push_back({"joints from posture to posture", "rad", 0, kFirstJoint, 1});
  groups.push_back({"corners of the boards under the stripe", "px", 0, corner, noise.allowance});
  groups.push_back({"a stripe's place", "px", 0, kFirstStripe_px, 1});
  groups.push_back({"a stripe's direction", "px", 0, kFirstStripe_px, 1});
  return groups;
}

}  // namespace tankrig
