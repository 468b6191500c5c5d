#include "calibration/intrinsics/model_choice.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr double kDoubt = 2;            // standard errors
constexpr double kLeastSquare = 1e-12;  // px^2
constexpr std::size_t kFolds = 5, kFewestToHoldBack = 6;

struct Trial {
  TriedModel model;
  BoardBundle bundle;
  std::vector<CornerResidual> residuals;
  std::vector<double> squares;  ///< mean square of each picture, held back
};

/// Of each picture, by the model of the others.
std::vector<double> held_back_squares(const BoardBundle& all) {
  std::vector<double> squares(all.views.size());
  const std::size_t folds = std::min(kFolds, all.views.size());
  for (std::size_t fold = 0; fold < folds; ++fold) {
    BoardBundle others = all;
    others.views.clear(), others.cMt.clear();
    for (std::size_t v = 0; v < all.views.size(); ++v)
      if (v % folds != fold) others.views.push_back(all.views[v]), others.cMt.push_back(all.cMt[v]);
    solve(others);
    for (std::size_t v = fold; v < all.views.size(); v += folds) {
      const auto pose = board_pose(others.cameras.front(), others.points(), all.views[v].seen.front());
      squares[v] = pose ? pose->rms * pose->rms : 1e6;
    }
  }
  return squares;
}

Trial try_model(const BoardBundle& first, LensModel lens, bool bends, bool hold_back) {
  Trial trial;
  trial.bundle = first;
  trial.bundle.lens = lens;
  trial.bundle.bends = bends;
  const std::vector<int> free = free_parameters(lens);
  CameraParameters start = parameters_of(first.cameras.front());
  for (int i = 4; i < kCameraParameters && !first.lens_held; ++i)
    if (std::find(free.begin(), free.end(), i) == free.end()) start[static_cast<std::size_t>(i)] = 0;
  trial.bundle.cameras.front() = camera_of(first.cameras.front(), start);
  if (!bends) trial.bundle.bend.setZero();
  const BundleFit fit = solve(trial.bundle);
  if (!fit.converged)
    throw InputError(fmt::format("the lens model {} does not converge on these pictures", name_of(lens)));
  trial.residuals = fit.residuals;
  const bool port = first.cameras.front().port.has_value();
  const std::size_t parameters = (first.lens_held ? 0 : free.size()) + (port ? kPortParameters : 0);
  trial.model = {lens, bends, port, static_cast<int>(parameters), rms(fit.residuals), 0, 0, 0};
  if (!hold_back) return trial;
  trial.squares = held_back_squares(trial.bundle);
  double sum = 0;
  for (const double square : trial.squares) sum += square;
  trial.model.held_back_rms = std::sqrt(sum / double(trial.squares.size()));
  return trial;
}

/// How much worse `trial` is than `best` on pictures held back.
void compare(Trial& trial, const Trial& best) {
  const double n = double(trial.squares.size());
  double sum = 0, squares = 0;
  for (std::size_t v = 0; v < trial.squares.size(); ++v) sum += trial.squares[v] - best.squares[v];
  trial.model.excess = sum / n;
  for (std::size_t v = 0; v < trial.squares.size(); ++v) {
    const double deviation = trial.squares[v] - best.squares[v] - trial.model.excess;
    squares += deviation * deviation;
  }
  trial.model.excess_sigma = std::sqrt(squares / (n - 1) / n);
}

/// A picture's error, held back, by one model over that by another: the mean of its logarithm. Near boards err by far the most, and
/// would drown the others in a mean of squares.
struct ErrorRatio {
  double log = 0, sigma = 0;
};
ErrorRatio error_ratio(const Trial& a, const Trial& b) {
  const double n = double(a.squares.size());
  std::vector<double> logs;
  for (std::size_t v = 0; v < a.squares.size(); ++v)
    logs.push_back(std::log(std::max(a.squares[v], kLeastSquare) / std::max(b.squares[v], kLeastSquare)) / 2);
  ErrorRatio ratio;
  for (const double log : logs) ratio.log += log / n;
  for (const double log : logs) ratio.sigma += (log - ratio.log) * (log - ratio.log) / (n - 1) / n;
  ratio.sigma = std::sqrt(ratio.sigma);
  return ratio;
}

/// The rig's camera model has no place for a rational distortion.
bool can_be_taken(const Trial& trial) { return trial.model.lens != LensModel::kRational; }

/// The first of `trials` that is not worse than the best beyond doubt; the best of those that can be taken, if none is.
std::size_t simplest_that_fits(std::vector<Trial>& trials) {
  const auto better = [](const Trial& a, const Trial& b) { return a.model.held_back_rms < b.model.held_back_rms; };
  const Trial best = *std::min_element(trials.begin(), trials.end(), better);
  for (Trial& trial : trials) compare(trial, best);
  const auto end = std::find_if_not(trials.begin(), trials.end(), can_be_taken);
  const auto chosen = std::find_if(
      trials.begin(), end, [](const Trial& trial) { return trial.model.excess <= kDoubt * trial.model.excess_sigma; });
  return static_cast<std::size_t>((chosen == end ? std::min_element(trials.begin(), end, better) : chosen) -
                                  trials.begin());
}

std::string decided(const char* what, const std::vector<Trial>& trials, std::size_t chosen, auto name) {
  const Trial& taken = trials[chosen];
  std::string words =
      fmt::format("{}{}: {:.4f} px on pictures held back", what, name(taken.model), taken.model.held_back_rms);
  if (taken.model.excess > kDoubt * taken.model.excess_sigma)
    return words + fmt::format(
                       ", {:.2g} px^2 above the rational model, beyond two standard errors ({:.2g}): the lens needs "
                       "k4, k5, k6, which tankrig's camera model does not have",
                       taken.model.excess, taken.model.excess_sigma);
  if (taken.model.excess > 0)
    words += fmt::format(", {:.2g} px^2 above the best, within two standard errors ({:.2g})", taken.model.excess,
                         taken.model.excess_sigma);
  if (chosen > 0) {
    const Trial& simpler = trials[chosen - 1];
    words +=
        fmt::format("; the simpler {}: {:.4f} px, {:.2g} px^2 above the best, beyond two standard errors ({:.2g})",
                    name(simpler.model), simpler.model.held_back_rms, simpler.model.excess, simpler.model.excess_sigma);
  }
  return words;
}

ModelChoice taken(Trial& trial, const std::vector<Trial>& tried, std::string decision) {
  ModelChoice choice{std::move(trial.bundle), std::move(trial.residuals), {}, std::move(decision)};
  for (const Trial& one : tried) choice.tried.push_back(one.model);
  return choice;
}

}  // namespace

ModelChoice choose_model(const BoardBundle& first, std::optional<LensModel> lens, std::optional<bool> bends) {
  const bool hold_back = first.views.size() >= kFewestToHoldBack;
  if (!hold_back && !lens) lens = LensModel::kK1K2;
  if (!hold_back && !bends) bends = false;
  std::vector<Trial> trials;
  for (const LensModel one : kLensModels)
    if (!lens || one == *lens) trials.push_back(try_model(first, one, bends.value_or(false), hold_back));
  std::size_t chosen = hold_back ? simplest_that_fits(trials) : 0;
  std::string decision = !hold_back ? fmt::format("fewer than {} pictures: models are not compared", kFewestToHoldBack)
                                    : decided("lens model ", trials, chosen,
                                              [](const TriedModel& m) { return std::string(name_of(m.lens)); });
  if (!bends) {
    std::vector<Trial> shapes;
    shapes.push_back(std::move(trials[chosen]));
    shapes.push_back(try_model(shapes.front().bundle, shapes.front().model.lens, true, true));
    const TriedModel flat = shapes.front().model;
    const std::size_t shape = simplest_that_fits(shapes);
    decision += "\n" + decided("target ", shapes, shape,
                               [](const TriedModel& m) { return std::string(m.bends ? "bent" : "flat"); });
    trials[chosen].model = flat;
    Trial& winner = shapes[shape];
    trials.push_back({shapes[1].model, {}, {}, {}});
    return taken(winner, trials, std::move(decision));
  }
  return taken(trials[chosen], trials, std::move(decision));
}

ModelChoice choose_port(ModelChoice choice, const BoardBundle& behind, std::optional<LensModel> lens) {
  if (behind.views.size() < kFewestToHoldBack)
    throw InputError(fmt::format("found the target in {} pictures, expected {} at least to tell a port from a pinhole",
                                 behind.views.size(), kFewestToHoldBack));
  const BoardBundle& pinhole = choice.bundle;
  std::vector<Trial> ports;
  for (const LensModel one : kLensModels)
    if (one != LensModel::kRational && (behind.lens_held ? one == LensModel::kPlumbBob : !lens || one == *lens))
      ports.push_back(try_model(behind, one, pinhole.bends, true));
  const Trial lens_alone = try_model(pinhole, pinhole.lens, pinhole.bends, true);
  Trial& port = ports[simplest_that_fits(ports)];
  const ErrorRatio ratio = error_ratio(lens_alone, port);
  const bool port_is_simpler = port.model.parameters < lens_alone.model.parameters;
  const bool taken = port_is_simpler ? ratio.log > -kDoubt * ratio.sigma : ratio.log > kDoubt * ratio.sigma;
  const TriedModel &kept = taken ? port.model : lens_alone.model, &other = taken ? lens_alone.model : port.model;
  const auto name = [](const TriedModel& m) { return m.port ? "flat port" : "pinhole"; };
  choice.decision += fmt::format(
      "\nwindow {}: {:.4f} px on pictures held back; the {} {}: {:.4f} px, a picture's error {:.2f} times as large, {} "
      "two "
      "standard errors (a factor of {:.2f})",
      name(kept), kept.held_back_rms, taken == port_is_simpler ? "less simple" : "simpler", name(other),
      other.held_back_rms, std::exp(taken ? ratio.log : -ratio.log),
      std::abs(ratio.log) > kDoubt * ratio.sigma ? "beyond" : "within", std::exp(kDoubt * ratio.sigma));
  for (const Trial& trial : ports) choice.tried.push_back(trial.model);
  if (taken) {
    choice.bundle = std::move(port.bundle);
    choice.residuals = std::move(port.residuals);
  }
  return choice;
}

}  // namespace tankrig
