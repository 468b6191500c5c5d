#include "calibration/hand_eye/arm_choice.hpp"

#include <fmt/core.h>

#include <cmath>

#include "calibration/estimate/least_squares.hpp"
#include "calibration/hand_eye/error_sources.hpp"
#include "core/angles.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kFolds = 5;
// By how much held-back views must be fitted better: their mean square by a little and surely, or by much.
constexpr double kLeastGain = 2;  // standard errors
constexpr double kLittle = 0.95, kMuch = 0.4;
constexpr double kMostAngleSigma = 0.02;   // [rad] of a refined angle: beyond it the data does not know
constexpr double kMostLengthSigma = 0.01;  // [m]

enum Number { kA, kAlpha, kD, kTheta };
constexpr int number_of(int link, Number number) { return 4 * link + number; }

struct Candidate {
  const char* name;
  ChainNumbers numbers;
};

const std::vector<Candidate>& candidates() {
  static const ChainNumbers zeros{number_of(1, kTheta), number_of(2, kTheta)};
  static const ChainNumbers links{number_of(0, kA),     number_of(0, kAlpha), number_of(1, kA),
                                  number_of(1, kAlpha), number_of(1, kD),     number_of(1, kTheta),
                                  number_of(2, kA),     number_of(2, kAlpha), number_of(2, kTheta)};
  static const std::vector<Candidate> all{
      {"as given", {}}, {"shoulder and elbow zero", zeros}, {"zeros and links", links}};
  return all;
}

/// Mean square error of every view by a fit that did not have it; not finite if a fit has no minimum.
std::vector<double> held_back(const HandEyeProblem& problem, const std::vector<std::size_t>& views,
                              const ChainNumbers& numbers, const HandEyeState& start) {
  std::vector<double> squares(views.size());
  for (std::size_t fold = 0; fold < kFolds; ++fold) {
    std::vector<std::size_t> rest;
    for (std::size_t k = 0; k < views.size(); ++k)
      if (k % kFolds != fold) rest.push_back(views[k]);
    HandEyeState state = start;
    minimise(problem, rest, numbers, {}, 0, state);
    for (std::size_t k = fold; k < views.size(); k += kFolds)
      squares[k] = std::pow(view_rms(problem, problem.views[views[k]], state), 2);
  }
  return squares;
}

double mean(const std::vector<double>& numbers) {
  double sum = 0;
  for (const double n : numbers) sum += n / static_cast<double>(numbers.size());
  return sum;
}

/// By how many standard errors `more` is below `less`.
double gain(const std::vector<double>& less, const std::vector<double>& more) {
  std::vector<double> by;
  for (std::size_t k = 0; k < less.size(); ++k) by.push_back(less[k] - more[k]);
  const double middle = mean(by);
  double squares = 0;
  for (const double b : by) squares += (b - middle) * (b - middle);
  const double n = static_cast<double>(by.size());
  return middle / std::sqrt(squares / (n * (n - 1)));
}

/// Name of a refined number that the data leaves open; empty: none.
std::string open_number(const HandEyeProblem& problem, const std::vector<std::size_t>& views,
                        const ChainNumbers& numbers, const HandEyeState& state) {
  std::vector<ViewErrors> errors;
  std::vector<Eigen::MatrixXd> unit;
  for (const std::size_t i : views) {
    auto of_view = view_errors(problem, problem.views[i], state, numbers);
    if (!of_view) return problem.views[i].name;
    unit.push_back(Eigen::MatrixXd::Identity(of_view->residuals.size(), of_view->residuals.size()));
    errors.push_back(*std::move(of_view));
  }
  const auto& [residuals, jacobian] = whitened(errors, unit);
  std::vector<std::string> names(2 * kPoseStep, "the camera's place");
  for (const int k : numbers) names.push_back(chain_name(k));
  try {
    const Eigen::MatrixXd covariance = covariance_of(jacobian, names, "");
    const double variance = residuals.squaredNorm() / static_cast<double>(jacobian.rows() - jacobian.cols());
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      const Eigen::Index at = 2 * kPoseStep + static_cast<Eigen::Index>(k);
      if (std::sqrt(variance * covariance(at, at)) > (numbers[k] % 2 ? kMostAngleSigma : kMostLengthSigma))
        return chain_name(numbers[k]);
    }
  } catch (const InputError&) {  // of covariance_of: a number is wholly open
    return chain_name(numbers.back());
  }
  return "";
}

}  // namespace

std::string chain_name(int number) {
  constexpr const char* kNumbers[] = {"a", "alpha", "d", "zero"};
  return fmt::format("{} {}", kJointNames[static_cast<std::size_t>(number / 4)], kNumbers[number % 4]);
}

ArmModel with_added(const ArmModel& arm, const std::array<double, kDhNumbers>& chain) {
  ArmModel out = arm;
  for (std::size_t i = 0; i < out.dh.size(); ++i) {
    DhLink& link = out.dh[i];
    double* const numbers[] = {&link.a, &link.alpha, &link.d, &link.theta0};
    for (std::size_t k = 0; k < 4; ++k) *numbers[k] += chain[4 * i + k];
  }
  return out;
}

std::vector<HandEyeView> selected(const std::vector<HandEyeView>& views, const std::vector<std::size_t>& which) {
  std::vector<HandEyeView> out;
  for (const std::size_t i : which) out.push_back(views[i]);
  return out;
}

ChainNumbers choose_arm(const HandEyeProblem& problem, const std::vector<std::size_t>& views, HandEyeState& state,
                        HandEyeSolution& solution) {
  solution.choices.clear();
  state.chain = {};
  minimise(problem, views, {}, {}, 0, state);
  HandEyeState taken_state = state;
  std::vector<double> taken_squares;
  std::size_t taken = 0;
  const char* const unit = solution.pixels ? "px" : "mm";
  const double scale = solution.pixels ? 1 : 1e3;
  for (std::size_t c = 0; c < candidates().size(); ++c) {
    const auto& [name, numbers] = candidates()[c];
    if (c > 1 && !problem.refine_links) break;
    // A fit on four fifths of the views needs more of them than numbers.
    if (c > 0 && (!problem.refine_arm || !problem.views[0].q || 5 * views.size() < 12 + numbers.size())) break;
    std::vector<double> squares;
    HandEyeState fitted = taken_state;
    std::string against;
    try {
      minimise(problem, views, numbers, {}, 0, fitted);
      squares = held_back(problem, views, numbers, fitted);
      if (c > 0) against = open_number(problem, views, numbers, fitted);
    } catch (const InputError& e) {
      if (c == 0) throw;
      solution.decision = fmt::format("{} is kept: with {} {}", candidates()[taken].name, name, e.what());
      break;
    }
    const double rms = std::sqrt(mean(squares));
    solution.choices.push_back({name, rms, false});
    if (c > 0) {
      const double before = std::sqrt(mean(taken_squares)), by = gain(taken_squares, squares);
      const std::string figures =
          fmt::format("held-back views err by {:.3f} {} with {}, by {:.3f} {} with {} ({:.1f} standard errors)",
                      scale * before, unit, candidates()[taken].name, scale * rms, unit, name, by);
      if (!against.empty()) {
        solution.decision = fmt::format("{} is kept, because the views do not determine the {}: {}",
                                        candidates()[taken].name, against, figures);
        continue;
      }
      const double ratio = mean(squares) / mean(taken_squares);
      if (!(ratio < kMuch) && !(by > kLeastGain && ratio < kLittle)) {
        solution.decision = fmt::format("{} is kept: {}", candidates()[taken].name, figures);
        continue;
      }
      solution.decision = fmt::format("{} is refined: {}", name, figures);
    }
    taken = c;
    taken_squares = squares;
    taken_state = fitted;
  }
  for (ArmChoice& choice : solution.choices) choice.taken = choice.name == candidates()[taken].name;
  state = taken_state;
  return candidates()[taken].numbers;
}

}  // namespace tankrig
