#include "calibration/hand_eye/hand_eye.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "calibration/estimate/least_squares.hpp"
#include "calibration/hand_eye/arm_choice.hpp"
#include "calibration/hand_eye/closed_forms.hpp"
#include "calibration/hand_eye/error_sources.hpp"
#include "calibration/hand_eye/marker_error.hpp"
#include "calibration/hand_eye/view_consistency.hpp"
#include "core/angles.hpp"
#include "core/input_error.hpp"
#include "core/median.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kLeastViews = 6;
constexpr std::size_t kStarts = 3;
// Times the typical view's error: at first, when the arm's own errors are not yet known, and at last.
constexpr double kOutlier[] = {12, 5};
constexpr double kLeastOutlier_m = 1e-3;  // on the marker: below it no view is an outlier
constexpr double kMostOutliers = 0.25;    // of the views
constexpr double kMostError_m =
    0.02;                         // on the marker, of a typical view: beyond it no place of the camera explains the set
constexpr double kWeak_m = 0.05;  // a closed form that is farther off on the marker has failed

/// What an error on the marker is in the views' unit.
double in_unit(const HandEyeProblem& problem, double metres) {
  if (!problem.camera || problem.views[0].corners.empty()) return metres;
  std::vector<double> distances;
  for (const HandEyeView& v : problem.views) distances.push_back(v.cMg.translation().norm());
  return metres * problem.camera->fx / upper_median(distances);
}

void check(const HandEyeProblem& problem) {
  const std::vector<HandEyeView>& views = problem.views;
  if (views.size() < kLeastViews)
    throw InputError(fmt::format("hand-eye: found {} {} with the marker, expected at least {}", views.size(),
                                 views.size() == 1 ? "view" : "views", kLeastViews));
  for (const HandEyeView& v : views) {
    if (v.points.size() < 4)
      throw InputError(fmt::format("{}: found {} points of the marker, expected at least 4", v.name, v.points.size()));
    if (v.corners.size() != (problem.camera ? v.points.size() : 0))
      throw InputError(fmt::format("{}: found {} corners, expected {}", v.name, v.corners.size(),
                                   problem.camera ? v.points.size() : 0));
    if (v.q.has_value() != views[0].q.has_value())
      throw InputError(v.name + ": expected joints in every view or in none");
  }
  if (const std::string missing = missing_excitation(views); !missing.empty()) throw InputError("hand-eye: " + missing);
}

std::vector<double> rms_of_views(const HandEyeProblem& problem, const HandEyeState& state) {
  std::vector<double> all;
  for (const HandEyeView& v : problem.views) all.push_back(view_rms(problem, v, state));
  return all;
}

double typical(std::vector<double> rms) { return upper_median(rms); }

std::vector<std::size_t> all_of(const std::vector<HandEyeView>& views) {
  std::vector<std::size_t> all(views.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
  return all;
}

std::vector<std::size_t> outliers_of(const HandEyeProblem& problem, const HandEyeState& state, double times) {
  const std::vector<double> rms = rms_of_views(problem, state);
  const double most = std::max(times * typical(rms), in_unit(problem, kLeastOutlier_m));
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < rms.size(); ++i)
    if (!(rms[i] <= most)) out.push_back(i);
  return out;
}

std::string names_of(const std::vector<HandEyeView>& views, const std::vector<std::size_t>& which) {
  std::string names;
  for (std::size_t k = 0; k < which.size() && k < 5; ++k) names += (k ? ", " : "") + views[which[k]].name;
  return names + (which.size() > 5 ? ", ..." : "");
}

/// Two views that fit with each other's joints.
std::string swapped_joints(const HandEyeProblem& problem, const HandEyeState& state,
                           const std::vector<std::size_t>& outliers, double fits) {
  for (std::size_t a = 0; a < outliers.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) {
      HandEyeView one = problem.views[outliers[a]], other = problem.views[outliers[b]];
      std::swap(one.q, other.q);
      std::swap(one.bMe, other.bMe);
      if (view_rms(problem, one, state) < fits && view_rms(problem, other, state) < fits)
        return fmt::format("; {} and {} fit with each other's joints", other.name, one.name);
    }
  return "";
}

void refuse_misfits(const HandEyeProblem& problem, const HandEyeState& state, const HandEyeSolution& solution) {
  const double median = typical(rms_of_views(problem, state));
  const std::size_t all = problem.views.size(), out = solution.outliers.size();
  if (static_cast<double>(out) <= kMostOutliers * static_cast<double>(all) && all - out >= kLeastViews &&
      median <= in_unit(problem, kMostError_m))
    return;
  throw InputError(fmt::format(
      "hand-eye: {} of {} views do not fit one place of the camera ({}; the typical view errs by {:.3g} {}){}, "
      "expected pictures and joints of the same postures, of one marker and one camera",
      out ? out : all, all, out ? names_of(problem.views, solution.outliers) : "all alike",
      solution.pixels ? median : 1e3 * median, solution.pixels ? "px" : "mm",
      swapped_joints(problem, state, solution.outliers, std::max(3 * median, in_unit(problem, 5e-3)))));
}

void refuse_shifted(const HandEyeProblem& problem) {
  if (const int shift = shift_of_joints(problem.arm, problem.views); shift != 0)
    throw InputError(fmt::format(
        "hand-eye: the joints do not belong to their pictures: they fit those {} {} {}, expected both in one order",
        std::abs(shift), std::abs(shift) == 1 ? "place" : "places", shift > 0 ? "earlier" : "later"));
}

/// The robust least squares from the closed forms that fit best; the best of them.
HandEyeState from_best_start(const HandEyeProblem& problem, HandEyeSolution& solution) {
  std::vector<Transform> cMg, bMe;
  for (const HandEyeView& v : problem.views) {
    cMg.push_back(v.cMg);
    bMe.push_back(arm_pose(problem.arm, v));
  }
  std::vector<std::pair<double, std::size_t>> starts;
  for (const ClosedForm& form : closed_forms(cMg, bMe)) {
    solution.methods.push_back({form.name, form.failure, form.cMb, form.eMg});
    if (form.failure.empty())
      starts.emplace_back(typical(rms_of_views(problem, {form.cMb, form.eMg})), solution.methods.size() - 1);
  }
  std::sort(starts.begin(), starts.end());
  starts.resize(std::min(starts.size(), kStarts));
  HandEyeState best;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [before, method] : starts) {
    if (!std::isfinite(before)) continue;
    HandEyeState state{solution.methods[method].cMb, solution.methods[method].eMg};
    std::vector<std::size_t> in_front;
    for (std::size_t i = 0; i < problem.views.size(); ++i)
      if (std::isfinite(view_rms(problem, problem.views[i], state))) in_front.push_back(i);
    try {
      minimise(problem, in_front, {}, {}, std::max(before / 3, in_unit(problem, kLeastOutlier_m)), state);
    } catch (const InputError&) {
      continue;  // another start may have a minimum; none at all is refused below
    }
    const double after = typical(rms_of_views(problem, state));
    if (after < least) {
      least = after;
      best = state;
      solution.start = solution.methods[method].name;
    }
  }
  if (!std::isfinite(least))
    throw InputError("hand-eye: no closed form found a place of the camera that sees the marker in the views");
  return best;
}

/// What the refined result says about the closed forms.
void judge(const HandEyeProblem& problem, const std::vector<std::size_t>& views, HandEyeSolution& solution) {
  const Vector3d target_b = solution.cMb.inverse() * problem.target_c;
  const double most = in_unit(problem, kWeak_m);
  for (HandEyeMethod& m : solution.methods) {
    if (!m.failure.empty()) continue;
    double sum = 0;
    for (const std::size_t i : views) sum += std::pow(view_rms(problem, problem.views[i], {m.cMb, m.eMg}), 2);
    m.rms = std::sqrt(sum / static_cast<double>(views.size()));
    m.rotation = Eigen::AngleAxisd(Eigen::Matrix3d(m.cMb.linear() * solution.cMb.linear().transpose())).angle();
    m.at_target = (m.cMb * target_b - problem.target_c).norm();
    if (!std::isfinite(m.rms))
      m.failure = "puts the marker behind the camera";
    else if (m.rms > most)
      m.failure = fmt::format("misses the marker by more than {:.0f} mm", 1e3 * kWeak_m);
  }
}

/// Where a target point that the end effector reaches from the mean posture comes to lie in c, by the solution's parameters.
Eigen::MatrixXd target_by(const HandEyeProblem& problem, const HandEyeState& state, const ChainNumbers& refined) {
  HandEyeProblem point = problem;
  point.camera.reset();
  HandEyeView view;
  view.q = problem.views[0].q;
  view.bMe = problem.views[0].bMe;
  if (view.q) {
    view.q->setZero();
    for (const HandEyeView& v : problem.views) *view.q += *v.q / static_cast<double>(problem.views.size());
  }
  const Transform cMe = state.cMb * (view.q ? end_effector(problem.arm, *view.q, state.chain.data()) : view.bMe);
  view.points = {state.eMg.inverse() * (cMe.inverse() * problem.target_c)};
  Eigen::MatrixXd by = view_errors(point, view, state, refined)->by_state;
  by.middleCols(kPoseStep, kPoseStep).setZero();  // how the marker is held moves no target
  return by;
}

std::vector<Estimate> named_parameters(const HandEyeState& state, const ChainNumbers& refined) {
  std::vector<Estimate> out;
  const auto add_pose = [&](const std::string& name, const Transform& aMb) {
    const auto step = step_between(Transform::Identity(), aMb);
    for (int k = 0; k < kPoseStep; ++k)
      out.push_back({fmt::format("{} {} {}", name, k < 3 ? "rotation" : "translation", "xyz"[k % 3]),
                     k < 3 ? "rad" : "m", step[k], 0, 0, 0});
  };
  add_pose("cMb", state.cMb);
  add_pose("eMg", state.eMg);
  for (const int k : refined)
    out.push_back({chain_name(k), k % 2 ? "rad" : "m", state.chain[static_cast<std::size_t>(k)], 0, 0, 0});
  return out;
}

std::vector<ViewErrors> errors_of(const HandEyeProblem& problem, const std::vector<std::size_t>& views,
                                  const HandEyeState& state, const ChainNumbers& refined) {
  std::vector<ViewErrors> out;
  for (const std::size_t i : views) {
    auto errors = view_errors(problem, problem.views[i], state, refined);
    if (!errors) throw InputError(problem.views[i].name + ": the solution puts the marker behind the camera");
    out.push_back(*std::move(errors));
  }
  return out;
}

/// Weighs corners and joints by what they err, and fills in what follows from that.
void finish(const HandEyeProblem& problem, const std::vector<std::size_t>& views, const ChainNumbers& refined,
            HandEyeState state, HandEyeSolution& solution) {
  constexpr int kRounds = 3;
  std::vector<ViewErrors> errors = errors_of(problem, views, state, refined);
  ErrorSources sources;
  for (int round = 0; round < kRounds; ++round) {
    sources = error_sources(errors, !solution.pixels);
    minimise(problem, views, refined, sources.whiten, 0, state);
    errors = errors_of(problem, views, state, refined);
  }
  const Eigen::MatrixXd jacobian = whitened(errors, sources.whiten).jacobian;
  solution.cMb = state.cMb;
  solution.eMg = state.eMg;
  solution.arm = with_added(problem.arm, state.chain);
  solution.parameters = named_parameters(state, refined);
  std::vector<std::string> names;
  for (const Estimate& e : solution.parameters) names.push_back(e.name);
  solution.covariance = covariance_of(jacobian, names, "hand-eye");
  solution.corner_sigma = sources.corner;
  solution.joint_sigma = sources.joint;
  solution.degrees_of_freedom = sources.degrees_of_freedom;
  const Eigen::MatrixXd target = target_by(problem, state, refined);
  solution.target_sigma = moved_by(target, solution.covariance);
  const double factor = interval_factor(sources.degrees_of_freedom);
  double sum = 0;
  for (Eigen::Index k = 0; k < jacobian.cols(); ++k) {
    Estimate& e = solution.parameters[static_cast<std::size_t>(k)];
    e.sigma = std::sqrt(solution.covariance(k, k));
    e.half_width = factor * e.sigma;
    e.effect = target.col(k).norm() * e.sigma;
  }
  solution.view_rms = rms_of_views(problem, state);
  for (const std::size_t i : views) sum += std::pow(solution.view_rms[i], 2) / static_cast<double>(views.size());
  solution.rms = std::sqrt(sum);
}

}  // namespace

HandEyeSolution solve(const HandEyeProblem& given) {
  check(given);
  HandEyeProblem problem = given;
  HandEyeSolution solution;
  solution.pixels = problem.camera.has_value();
  solution.flipped = pick_poses(problem.arm, problem.views);
  refuse_shifted(problem);
  HandEyeState state = from_best_start(problem, solution);

  ChainNumbers refined;
  std::vector<std::size_t> views = all_of(problem.views);
  for (const double times : kOutlier) {
    const std::vector<std::size_t> before = views;
    solution.outliers = outliers_of(problem, state, times);
    views = all_of(problem.views);
    std::erase_if(views, [&](std::size_t i) {
      return std::find(solution.outliers.begin(), solution.outliers.end(), i) != solution.outliers.end();
    });
    refuse_misfits(problem, state, solution);
    if (times != kOutlier[0] && views == before) break;
    refined = choose_arm(problem, views, state, solution);
  }
  if (const std::string missing = missing_excitation(selected(problem.views, views)); !missing.empty())
    throw InputError("hand-eye: without " + names_of(problem.views, solution.outliers) + ", which do not fit, " +
                     missing);
  finish(problem, views, refined, state, solution);
  judge(problem, views, solution);
  return solution;
}

}  // namespace tankrig
