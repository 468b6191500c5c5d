// From a measured rig to its drawings, one part after another.
#include <fmt/format.h>

#include <cmath>

#include "calibration/budget/error_budget.hpp"
#include "calibration/intrinsics/board_bundle.hpp"
#include "core/angles.hpp"
#include "core/lens_numbers.hpp"

namespace tankrig {
namespace {

using PickCamera = BudgetCamera& (*)(MeasuringRig&);

CameraModel between(const CameraModel& from, const CameraModel& to, double share) {
  CameraModel model = from;
  for (const auto member : kLensNumbers) model.*member += share * (to.*member - from.*member);
  if (from.port && to.port) {
    PortParameters port = parameters_of(*from.port);
    const PortParameters other = parameters_of(*to.port);
    for (std::size_t i = 0; i < port.size(); ++i) port[i] += share * (other[i] - port[i]);
    model.port = port_of(*from.port, port);
  }
  return model;
}

/// Largest distance between the pixels at which two models see the same points, a metre off [px].
double apart_px(const CameraModel& a, const CameraModel& b) {
  double worst = 0;
  for (const double v : {0.1, 0.5, 0.9})
    for (const double u : {0.1, 0.5, 0.9}) {
      const Vector2d pixel(u * a.width, v * a.height);
      if (const auto there = b.project(a.sight(pixel.x(), pixel.y()).at(1)))
        worst = std::max(worst, (*there - pixel).norm());
    }
  return worst;
}

void add(std::vector<Uncertainty>& all, const std::string& name, const std::string& size,
         std::function<void(MeasuringRig&, JointVector&, double)> change) {
  all.push_back({name, size, true, {{1, std::move(change)}}});
}

void add_lens(std::vector<Uncertainty>& all, const BudgetCamera& measured, const BudgetCamera& nominal,
              PickCamera pick) {
  add(all, measured.name + ": lens", fmt::format("{:.1f} px", apart_px(measured.model, nominal.model)),
      [pick, from = measured.model, to = nominal.model](MeasuringRig& rig, JointVector&, double amount) {
        pick(rig).model = between(from, to, amount);
      });
}

/// `pose` is the measured one, and `change` what makes it the nominal one from the left: nominal = change * pose.
void add_pose(std::vector<Uncertainty>& all, const std::string& name, const Transform& measured,
              const Transform& nominal, std::function<void(MeasuringRig&, const Transform& change)> apply) {
  const Vector3d way = nominal.translation() - measured.translation();
  const Eigen::AngleAxisd turn(nominal.linear() * measured.linear().transpose());
  add(all, name + ": position", fmt::format("{:.1f} mm", 1e3 * way.norm()),
      [=](MeasuringRig& rig, JointVector&, double amount) {
        apply(rig, Transform(Eigen::Translation3d(amount * way)));
      });
  add(all, name + ": direction", fmt::format("{:.2f} degrees", to_degrees(turn.angle())),
      [=, centre = Vector3d(measured.translation())](MeasuringRig& rig, JointVector&, double amount) {
        apply(rig, Eigen::Translation3d(centre) * Transform(Eigen::AngleAxisd(amount * turn.angle(), turn.axis())) *
                       Eigen::Translation3d(-centre));
      });
}

}  // namespace

std::vector<Uncertainty> differences_of(const MeasuringRig& measured, const MeasuringRig& nominal, double time_offset,
                                        const BudgetSweep& sweep) {
  std::vector<Uncertainty> all;
  const PickCamera mono = [](MeasuringRig& rig) -> BudgetCamera& { return rig.mono; };
  const PickCamera left = [](MeasuringRig& rig) -> BudgetCamera& { return *rig.left; };
  const PickCamera right = [](MeasuringRig& rig) -> BudgetCamera& { return *rig.right; };
  add_lens(all, measured.mono, nominal.mono, mono);
  add_pose(all, measured.mono.name, measured.mono.bMc, nominal.mono.bMc,
           [](MeasuringRig& rig, const Transform& change) { rig.mono.bMc = change * rig.mono.bMc; });
  if (measured.left && measured.right && nominal.left && nominal.right) {
    add_lens(all, *measured.left, *nominal.left, left);
    add_lens(all, *measured.right, *nominal.right, right);
    add_pose(all, measured.left->name, measured.left->bMc, nominal.left->bMc,
             [](MeasuringRig& rig, const Transform& change) {
               rig.left->bMc = change * rig.left->bMc;
               rig.right->bMc = change * rig.right->bMc;
             });
    // What is left once both eyes have moved as the left one.
    const Transform moved = measured.left->bMc * nominal.left->bMc.inverse() * nominal.right->bMc;
    add_pose(all, "right in left", measured.right->bMc, moved,
             [](MeasuringRig& rig, const Transform& change) { rig.right->bMc = change * rig.right->bMc; });
  }
  const char* const names[] = {"slew", "shoulder", "elbow", "jaw rotation"};
  for (std::size_t joint = 0; joint < 4; ++joint) {
    const double off = nominal.arm.dh[joint].theta0 - measured.arm.dh[joint].theta0;
    add(all, std::string(names[joint]) + ": zero", fmt::format("{:.2f} degrees", to_degrees(std::abs(off))),
        [joint, off](MeasuringRig&, JointVector& q, double amount) { q[static_cast<int>(joint)] += amount * off; });
  }
  const Vector3d turn = nominal.ePl.normal - measured.ePl.normal;
  const double off = nominal.ePl.offset - measured.ePl.offset;
  add(all, "laser: plane",
      fmt::format("{:.2f} degrees, {:.1f} mm",
                  to_degrees(std::asin(std::min(1.0, measured.ePl.normal.cross(nominal.ePl.normal).norm()))),
                  1e3 * std::abs(off)),
      [turn, off](MeasuringRig& rig, JointVector&, double amount) {
        rig.ePl.normal = (rig.ePl.normal + amount * turn).normalized();
        rig.ePl.offset += amount * off;
      });
  const double velocity = sweep.velocity;
  add(all, measured.mono.name + ": time offset", fmt::format("{:.1f} ms", 1e3 * std::abs(time_offset)),
      [velocity, time_offset](MeasuringRig&, JointVector& q, double amount) {
        q[kElbow] += velocity * amount * time_offset;
      });
  return all;
}

}  // namespace tankrig
