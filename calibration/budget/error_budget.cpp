#include "calibration/budget/error_budget.hpp"

#include <algorithm>
#include <cmath>

#include "core/input_error.hpp"
#include "core/ray_meeting.hpp"

namespace tankrig {
namespace {

/// What is seen of a place, whatever the rig believes of itself.
struct LaserSight {
  Vector2d pixel;
  JointVector q;
};
struct StereoSight {
  Vector2d left, right;
};

std::optional<Vector2d> seen_by(const BudgetCamera& camera, const BudgetTarget& target) {
  const Vector3d way = camera.bMc.translation() - target.p;
  if (target.normal.dot(way) <= 0.05 * way.norm()) return std::nullopt;
  const auto pixel = camera.model.project(camera.bMc.inverse() * target.p);
  return pixel && camera.model.contains(*pixel) ? pixel : std::nullopt;
}

/// The elbow at which the sheet passes the place.
std::optional<JointVector> lit_at(const MeasuringRig& rig, const BudgetSweep& sweep, const BudgetTarget& target) {
  const auto distance = [&](double elbow) {
    JointVector q = sweep.posture;
    q[kElbow] = elbow;
    return rig.ePl.distance(rig.arm.bMe(q).inverse() * target.p);
  };
  double low = std::min(sweep.from, sweep.to), high = std::max(sweep.from, sweep.to);
  const double at_low = distance(low);
  if ((at_low < 0) == (distance(high) < 0)) return std::nullopt;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    ((distance(middle) < 0) == (at_low < 0) ? low : high) = middle;
  }
  JointVector q = sweep.posture;
  q[kElbow] = low;
  return q;
}

Vector3d by_laser(const MeasuringRig& rig, const LaserSight& sight, const JointVector& q) {
  const Plane bPl = rig.arm.bMe(q) * rig.ePl;
  const ViewingRay ray = rig.mono.bMc * rig.mono.model.sight(sight.pixel.x(), sight.pixel.y());
  return ray.at(-bPl.distance(ray.origin) / bPl.normal.dot(ray.direction));
}

Vector3d by_stereo(const MeasuringRig& rig, const StereoSight& sight) {
  return meeting(rig.left->bMc * rig.left->model.sight(sight.left.x(), sight.left.y()),
                 rig.right->bMc * rig.right->model.sight(sight.right.x(), sight.right.y()));
}

/// Mean square, over the target, of how far a sigma of this freedom takes places off the surface; by differences to both sides.
struct Cost {
  double laser = 0, stereo = 0;
};

class Sights {
 public:
  Sights(const MeasuringRig& rig, const BudgetSweep& sweep, const std::vector<BudgetTarget>& targets) : rig_(rig) {
    for (const BudgetTarget& target : targets) {
      const auto pixel = seen_by(rig.mono, target);
      const auto q = pixel ? lit_at(rig, sweep, target) : std::nullopt;
      if (q) laser_.push_back({*pixel, *q}), laser_targets_.push_back(target);
      if (!rig.left || !rig.right) continue;
      const auto left = seen_by(*rig.left, target), right = seen_by(*rig.right, target);
      if (left && right) stereo_.push_back({*left, *right}), stereo_targets_.push_back(target);
    }
  }

  Cost cost(const Freedom& freedom) const {
    Cost cost;
    for (std::size_t i = 0; i < laser_.size(); ++i)
      cost.laser += square(laser_targets_[i].normal, freedom,
                           [&](const MeasuringRig& rig, const JointVector& dq) {
                             return by_laser(rig, laser_[i], laser_[i].q + dq);
                           }) /
                    static_cast<double>(laser_.size());
    for (std::size_t i = 0; i < stereo_.size(); ++i)
      cost.stereo += square(stereo_targets_[i].normal, freedom,
                            [&](const MeasuringRig& rig, const JointVector&) { return by_stereo(rig, stereo_[i]); }) /
                     static_cast<double>(stereo_.size());
    return cost;
  }

  Misplacement misplaced(const MeasuringRig& believed, const Transform& bMbelieved) const {
    const auto of = [&](const auto& sights, const std::vector<BudgetTarget>& targets, auto measure) {
      Misplaced out;
      for (std::size_t i = 0; i < sights.size(); ++i) {
        const double off = targets[i].normal.dot(bMbelieved * measure(sights[i]) - targets[i].p);
        out.mean += off;
        out.rms += off * off;
      }
      out.places = sights.size();
      const double n = std::max<double>(1, static_cast<double>(out.places));
      out.mean /= n;
      out.rms = std::sqrt(out.rms / n);
      return out;
    };
    return {of(laser_, laser_targets_, [&](const LaserSight& s) { return by_laser(believed, s, s.q); }),
            of(stereo_, stereo_targets_, [&](const StereoSight& s) { return by_stereo(believed, s); })};
  }

  std::size_t laser() const { return laser_.size(); }
  std::size_t stereo() const { return stereo_.size(); }

 private:
  template <class Measure>
  double square(const Vector3d& normal, const Freedom& freedom, Measure measure) const {
    constexpr double kStep = 0.01;  // of sigma: the cost is that of small errors, in proportion
    const auto at = [&](double amount) {
      MeasuringRig rig = rig_;
      JointVector dq = JointVector::Zero();
      freedom.change(rig, dq, amount);
      return measure(rig, dq);
    };
    const Vector3d moved = (at(kStep * freedom.sigma) - at(-kStep * freedom.sigma)) / (2 * kStep);
    return std::pow(normal.dot(moved), 2);
  }

  const MeasuringRig& rig_;
  std::vector<LaserSight> laser_;
  std::vector<StereoSight> stereo_;
  std::vector<BudgetTarget> laser_targets_, stereo_targets_;
};

}  // namespace

Budget error_budget(const MeasuringRig& rig, const BudgetSweep& sweep, const std::vector<BudgetTarget>& targets,
                    const std::vector<Uncertainty>& uncertainties) {
  const Sights sights(rig, sweep, targets);
  if (sights.laser() + sights.stereo() == 0)
    throw InputError("budget: found nothing of the target that the sweep lights or both eyes see, expected some of it");
  Budget budget;
  budget.laser_targets = sights.laser(), budget.stereo_targets = sights.stereo();
  double laser = 0, stereo = 0;
  for (const Uncertainty& uncertainty : uncertainties) {
    Cost sum;
    for (const Freedom& freedom : uncertainty.freedoms) {
      const Cost cost = sights.cost(freedom);
      sum.laser += cost.laser, sum.stereo += cost.stereo;
    }
    constexpr double kNothing = 1e-20;
    BudgetLine line{uncertainty.name, uncertainty.sigma, uncertainty.measured, {}, {}};
    if (sum.laser > kNothing) line.laser = std::sqrt(sum.laser);
    if (sum.stereo > kNothing) line.stereo = std::sqrt(sum.stereo);
    laser += sum.laser, stereo += sum.stereo;
    budget.lines.push_back(std::move(line));
  }
  std::stable_sort(budget.lines.begin(), budget.lines.end(),
                   [](const BudgetLine& a, const BudgetLine& b) { return a.worst() > b.worst(); });
  budget.laser = std::sqrt(laser), budget.stereo = std::sqrt(stereo);
  return budget;
}

Misplacement misplacement(const MeasuringRig& rig, const MeasuringRig& believed, const Transform& bMbelieved,
                          const BudgetSweep& sweep, const std::vector<BudgetTarget>& targets) {
  return Sights(rig, sweep, targets).misplaced(believed, bMbelieved);
}

}  // namespace tankrig
