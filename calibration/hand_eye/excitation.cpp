// Whether a set of postures turns the marker about enough axes to tell where the camera stands.
#include <fmt/core.h>

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "calibration/hand_eye/closed_forms.hpp"
#include "calibration/hand_eye/hand_eye.hpp"
#include "core/angles.hpp"

namespace tankrig {
namespace {

constexpr double kLeastSpan_deg = 15;  // of each axis, from the last but one view at one end of it to that at the other
constexpr double kLeastTurn_deg = 4;   // root mean square, about the second of a set's own axes

/// What is wrong with the angles of one axis; empty: nothing.
std::string fault_of(const char* name, std::vector<double> angles) {
  std::sort(angles.begin(), angles.end());
  const double span = angles.size() < 4 ? 0 : to_degrees(angles[angles.size() - 2] - angles[1]);
  if (span >= kLeastSpan_deg) return "";
  return fmt::format("{} is excited over {:.1f} deg (without the outermost view at each end), expected at least {:.0f}",
                     name, span, kLeastSpan_deg);
}

std::string missing_of_joints(const std::vector<HandEyeView>& views) {
  std::vector<double> slew, pitch, wrist;
  for (const HandEyeView& v : views) {
    slew.push_back((*v.q)[kSlew]);
    pitch.push_back((*v.q)[kShoulder] + (*v.q)[kElbow]);  // their axes are parallel: the marker turns by the sum
    wrist.push_back((*v.q)[kJawRotate]);
  }
  std::string missing;
  for (const std::string& fault :
       {fault_of("slew", slew), fault_of("elbow (with shoulder)", pitch), fault_of("jaw_rotate", wrist)})
    if (!fault.empty()) missing += (missing.empty() ? "" : "; ") + fault;
  return missing;
}

std::string missing_of_poses(const std::vector<HandEyeView>& views) {
  std::vector<Transform> bMe;
  for (const HandEyeView& v : views) bMe.push_back(v.bMe);
  const Transform middle = mean_of(bMe);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Transform& m : bMe) {
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(middle.linear().transpose() * m.linear()));
    sum += turn.angle() * turn.axis() * (turn.angle() * turn.axis()).transpose() / static_cast<double>(bMe.size());
  }
  const Vector3d squares = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(sum).eigenvalues();
  const auto degrees = [&](int k) { return to_degrees(std::sqrt(std::max(0.0, squares[k]))); };
  if (degrees(2) < kLeastTurn_deg)
    return fmt::format("the arm hardly turns (by {:.1f} deg, root mean square), expected turns about two axes",
                       degrees(2));
  if (degrees(1) < kLeastTurn_deg)
    return fmt::format(
        "the arm turns about one axis alone (about the next by {:.1f} deg, root mean square), expected at least {:.0f}",
        degrees(1), kLeastTurn_deg);
  return "";
}

}  // namespace

std::string missing_excitation(const std::vector<HandEyeView>& views) {
  if (views.empty()) return "found no views";
  return views[0].q ? missing_of_joints(views) : missing_of_poses(views);
}

}  // namespace tankrig
