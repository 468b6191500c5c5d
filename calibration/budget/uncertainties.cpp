// Which freedoms a rig has, and how well each is known.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration/budget/error_budget.hpp"
#include "calibration/intrinsics/board_bundle.hpp"
#include "core/angles.hpp"
#include "core/lens_numbers.hpp"

namespace tankrig {
namespace {

// Of a rig that was built by its drawings and never measured: assumptions.
constexpr double kPosition = 0.010, kTurn = 0.0175;       // of cameras [m, rad]
constexpr double kEyePosition = 0.001, kEyeTurn = 0.004;  // of the right eye to the left one
constexpr double kFocalShare = 0.01, kCentre = 5, kRadial = 0.02, kTangential = 5e-4;
constexpr double kPortDistance = 0.005;
constexpr double kJointZero = 0.0087, kLaserTurn = 0.0175, kLaserMove = 0.003, kTime = 0.02;

using Camera = BudgetCamera& (*)(MeasuringRig&);
BudgetCamera& mono(MeasuringRig& rig) { return rig.mono; }
BudgetCamera& left(MeasuringRig& rig) { return *rig.left; }
BudgetCamera& right(MeasuringRig& rig) { return *rig.right; }

std::string millimetres(double m) { return fmt::format("{:.2g} mm", 1e3 * m); }
std::string milliradians(double rad) { return fmt::format("{:.2g} mrad", 1e3 * rad); }

/// A pose's freedoms along and about the axes of the frame it maps to: `bRf`, that frame's axes in b.
void add_pose(std::vector<Uncertainty>& all, const std::string& name, Camera camera, const Eigen::Matrix3d& bRf,
              const Vector3d& metres, const Vector3d& radians, bool measured, bool with_right) {
  Uncertainty moved{name + ": position", millimetres(metres.maxCoeff()), measured, {}};
  Uncertainty turned{name + ": direction", milliradians(radians.maxCoeff()), measured, {}};
  for (int k = 0; k < 3; ++k) {
    const Vector3d axis = bRf.col(k);
    const auto both = [camera, with_right](MeasuringRig& rig, const Transform& change) {
      camera(rig).bMc = change * camera(rig).bMc;
      if (with_right && rig.right) rig.right->bMc = change * rig.right->bMc;
    };
    moved.freedoms.push_back({metres[k], [both, axis](MeasuringRig& rig, JointVector&, double amount) {
                                both(rig, Transform(Eigen::Translation3d(amount * axis)));
                              }});
    turned.freedoms.push_back({radians[k], [both, camera, axis](MeasuringRig& rig, JointVector&, double amount) {
                                 const Vector3d centre = camera(rig).bMc.translation();
                                 both(rig, Eigen::Translation3d(centre) * Transform(Eigen::AngleAxisd(amount, axis)) *
                                               Eigen::Translation3d(-centre));
                               }});
  }
  all.push_back(std::move(moved));
  all.push_back(std::move(turned));
}

void add_port(std::vector<Uncertainty>& all, const BudgetCamera& seen, Camera camera, const CalibratedLens* lens) {
  if (!seen.model.port) return;
  const bool measured = lens && lens->sigma.size() > kLensNumbers.size();
  PortParameters sigma{kPortDistance, kTurn, kTurn};
  if (measured) std::copy(lens->sigma.begin() + kLensNumbers.size(), lens->sigma.end(), sigma.begin());
  Uncertainty port{seen.name + ": flat port",
                   millimetres(sigma[0]) + ", " + milliradians(std::max(sigma[1], sigma[2])),
                   measured,
                   {}};
  for (std::size_t i = 0; i < sigma.size(); ++i)
    port.freedoms.push_back({sigma[i], [camera, i](MeasuringRig& rig, JointVector&, double amount) {
                               FlatPort& changed = *camera(rig).model.port;
                               PortParameters numbers = parameters_of(changed);
                               numbers[i] += amount;
                               changed = port_of(changed, numbers);
                             }});
  all.push_back(std::move(port));
}

void add_lens(std::vector<Uncertainty>& all, const BudgetCamera& seen, Camera camera, const CalibratedLens* lens) {
  const double assumed[] = {kFocalShare * seen.model.fx,
                            kFocalShare * seen.model.fy,
                            kCentre,
                            kCentre,
                            kRadial,
                            kRadial,
                            kTangential,
                            kTangential,
                            0};
  const auto sigma = [&](std::size_t i) { return lens ? lens->sigma[i] : assumed[i]; };
  const auto part = [&](const char* name, std::size_t from, std::size_t to, const std::string& words) {
    Uncertainty uncertainty{seen.name + ": " + name, words, lens != nullptr, {}};
    for (std::size_t i = from; i < to; ++i)
      uncertainty.freedoms.push_back({sigma(i), [camera, i](MeasuringRig& rig, JointVector&, double amount) {
                                        camera(rig).model.*kLensNumbers[i] += amount;
                                      }});
    all.push_back(std::move(uncertainty));
  };
  part("focal lengths", 0, 2, fmt::format("{:.2g} px", sigma(0)));
  part("principal point", 2, 4, fmt::format("{:.2g} px", sigma(2)));
  part("distortion", 4, kLensNumbers.size(), fmt::format("k1 {:.2g}", sigma(4)));
  add_port(all, seen, camera, lens);
}

void add_camera(std::vector<Uncertainty>& all, const BudgetCamera& seen, Camera camera, const Calibration* calibration,
                bool with_right) {
  const CameraCalibration* known = calibration ? calibration->camera(seen.name) : nullptr;
  add_lens(all, seen, camera, known && known->lens ? &*known->lens : nullptr);
  if (known && known->mount)
    add_pose(all, seen.name, camera, Eigen::Matrix3d::Identity(), known->mount->sigma_m, known->mount->sigma_rad, true,
             with_right);
  else
    add_pose(all, seen.name, camera, Eigen::Matrix3d::Identity(), Vector3d::Constant(kPosition),
             Vector3d::Constant(kTurn), false, with_right);
}

void add_laser(std::vector<Uncertainty>& all, const MeasuringRig& rig, const CalibratedLaser* laser) {
  const Vector3d u = rig.ePl.normal.unitOrthogonal(), v = rig.ePl.normal.cross(u);
  const double turn = laser ? laser->sigma_rad : kLaserTurn, move = laser ? laser->sigma_m : kLaserMove;
  Uncertainty turned{"laser: direction", milliradians(turn), laser != nullptr, {}};
  for (const Vector3d& axis : {u, v})
    turned.freedoms.push_back({turn, [axis](MeasuringRig& r, JointVector&, double amount) {
                                 const Vector3d foot = -r.ePl.offset * r.ePl.normal;
                                 r.ePl = Eigen::Translation3d(foot) * Transform(Eigen::AngleAxisd(amount, axis)) *
                                         Eigen::Translation3d(-foot) * r.ePl;
                               }});
  all.push_back(std::move(turned));
  all.push_back({"laser: distance",
                 millimetres(move),
                 laser != nullptr,
                 {{move, [](MeasuringRig& r, JointVector&, double amount) { r.ePl.offset += amount; }}}});
}

}  // namespace

std::vector<Uncertainty> uncertainties_of(const MeasuringRig& rig, const Calibration* calibration,
                                          const BudgetSweep& sweep, const std::array<double, kJoints>& tick) {
  std::vector<Uncertainty> all;
  add_camera(all, rig.mono, mono, calibration, false);
  if (rig.left && rig.right) {
    add_camera(all, *rig.left, left, calibration, true);
    const CameraCalibration* eye = calibration ? calibration->camera(rig.right->name) : nullptr;
    add_lens(all, *rig.right, right, eye && eye->lens ? &*eye->lens : nullptr);
    const bool known = calibration && calibration->stereo;
    add_pose(all, "right in left", right, rig.left->bMc.linear(),
             known ? calibration->stereo->sigma_m : Vector3d::Constant(kEyePosition),
             known ? calibration->stereo->sigma_rad : Vector3d::Constant(kEyeTurn), known, false);
  }
  const CalibratedJoints* zeros = calibration && calibration->joints ? &*calibration->joints : nullptr;
  const char* const names[] = {"slew", "shoulder", "elbow", "jaw rotation"};
  for (std::size_t joint = 0; joint < 4; ++joint) {
    const double sigma = zeros ? zeros->sigma[joint] : kJointZero;
    const auto turn = [joint](MeasuringRig&, JointVector& q, double amount) { q[static_cast<int>(joint)] += amount; };
    all.push_back({std::string(names[joint]) + ": zero", milliradians(sigma), zeros != nullptr, {{sigma, turn}}});
    const double step = tick[joint] / std::sqrt(12.0);
    if (step > 0)
      all.push_back({std::string(names[joint]) + ": encoder's tick", milliradians(step), true, {{step, turn}}});
  }
  add_laser(all, rig, calibration && calibration->laser ? &*calibration->laser : nullptr);
  const CameraCalibration* timed = calibration ? calibration->camera(rig.mono.name) : nullptr;
  const bool known = timed && timed->time;
  const double late = known ? seconds(timed->time->sigma) : kTime;
  const double velocity = sweep.velocity;
  all.push_back(
      {rig.mono.name + ": time offset",
       fmt::format("{:.2g} ms", 1e3 * late),
       known,
       {{late, [velocity](MeasuringRig&, JointVector& q, double amount) { q[kElbow] += velocity * amount; }}}});
  return all;
}

}  // namespace tankrig
