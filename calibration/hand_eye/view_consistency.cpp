#include "calibration/hand_eye/view_consistency.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/angles.hpp"
#include "core/median.hpp"

namespace tankrig {
namespace {

constexpr double kMostDisagreement = 0.3;  // [rad] that one pair of views may add
constexpr int kMostPasses = 20;

double angle_between(const Transform& a, const Transform& b) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(a.linear().transpose() * b.linear())).angle();
}

double disagreement(const Transform& cMg, const Transform& bMe, const Transform& other_cMg,
                    const Transform& other_bMe) {
  return std::min(kMostDisagreement, std::abs(angle_between(cMg, other_cMg) - angle_between(bMe, other_bMe)));
}

}  // namespace

Transform arm_pose(const ArmModel& arm, const HandEyeView& view) { return view.q ? arm.bMe(*view.q) : view.bMe; }

std::vector<std::size_t> pick_poses(const ArmModel& arm, std::vector<HandEyeView>& views) {
  std::vector<Transform> bMe;
  for (const HandEyeView& v : views) bMe.push_back(arm_pose(arm, v));
  std::vector<bool> second(views.size(), false);
  const auto sum = [&](std::size_t i, const Transform& cMg) {
    double total = 0;
    for (std::size_t j = 0; j < views.size(); ++j)
      if (j != i) total += disagreement(cMg, bMe[i], views[j].cMg, bMe[j]);
    return total;
  };
  bool changed = true;
  for (int pass = 0; changed && pass < kMostPasses; ++pass) {
    changed = false;
    for (std::size_t i = 0; i < views.size(); ++i) {
      HandEyeView& v = views[i];
      if (!v.cMg_flipped || sum(i, *v.cMg_flipped) >= sum(i, v.cMg)) continue;
      std::swap(v.cMg, *v.cMg_flipped);
      second[i] = !second[i];
      changed = true;
    }
  }
  std::vector<std::size_t> flipped;
  for (std::size_t i = 0; i < views.size(); ++i)
    if (second[i]) flipped.push_back(i);
  return flipped;
}

int shift_of_joints(const ArmModel& arm, const std::vector<HandEyeView>& views) {
  constexpr int kMostShift = 3;
  const double tells = from_degrees(3);
  std::vector<Transform> bMe;
  for (const HandEyeView& v : views) bMe.push_back(arm_pose(arm, v));
  const int count = static_cast<int>(views.size());
  const auto typical = [&](int shift) {
    std::vector<double> each;
    for (int i = 0; i < count; ++i)
      for (int j = 0; j < i; ++j) {
        if (j + shift < 0 || i + shift < 0 || i + shift >= count || j + shift >= count) continue;
        const auto at = [](int k) { return static_cast<std::size_t>(k); };
        each.push_back(disagreement(views[at(i)].cMg, bMe[at(i + shift)], views[at(j)].cMg, bMe[at(j + shift)]));
      }
    return each.size() < 3 ? kMostDisagreement : upper_median(each);
  };
  const double as_given = typical(0);
  if (as_given < tells) return 0;
  int best = 0;
  double least = as_given / 3;
  for (int shift = -kMostShift; shift <= kMostShift; ++shift)
    if (shift != 0 && typical(shift) < least) least = typical(shift), best = shift;
  return best;
}

}  // namespace tankrig
