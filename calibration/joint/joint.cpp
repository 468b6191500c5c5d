#include "calibration/joint/joint.hpp"

#include <fmt/core.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>

#include "calibration/joint/joint_least_squares.hpp"
#include "core/angles.hpp"
#include "core/input_error.hpp"
#include "core/median.hpp"
#include "core/ray_meeting.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kLeastPostures = 6, kLeastViews = 3, kLeastSheets = 2, kLeastStripes = 10;
constexpr double kLeastElbow_deg = 5;
constexpr double kFirstMarker_px = 0.3, kFirstJoint = 5e-4, kFirstStripe_px = 0.2;
constexpr double kLeast_px = 1e-6, kLeastJoint = 1e-8;
constexpr int kRounds = 6;
constexpr double kStray = 5;  // robust standard deviations of a stripe from the plane

void check(const JointProblem& problem) {
  const std::size_t cameras = problem.boards.cameras.size();
  const auto refuse = [](const std::string& what) { throw InputError("joint refinement: " + what); };
  if (cameras == 0 || problem.boards.views.size() < kLeastViews ||
      problem.boards.cMt.size() != problem.boards.views.size())
    refuse(fmt::format("found {} boards, expected {} at least, with their places", problem.boards.views.size(),
                       kLeastViews));
  if (problem.cameras.size() != cameras)
    refuse(fmt::format("found {} cameras' names, expected {}", problem.cameras.size(), cameras));
  for (std::size_t k = 0; k < cameras; ++k)
    if (problem.boards.cameras[k].port)
      refuse(fmt::format("{} is behind a flat port, expected cameras without: it has none", problem.cameras[k]));
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
}

/// In the middle of the stripes as the steps place them; v along their longest extent.
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
  for (const RationalCamera& camera : problem.boards.cameras) state.lenses.push_back(parameters_of(camera));
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

/// (J' J)^-1 of the first columns of `linear`.
/// Errors: InputError naming one that the data leaves open.
struct Normal {
  Eigen::MatrixXd covariance, knocks, across;  ///< knocks: J' J of theirs; across: J' J of numbers by knocks
  Eigen::VectorXd gradient, knock_gradient;
};
Normal normal_of(const JointLinear& linear) {
  const auto n = static_cast<Eigen::Index>(linear.numbers.size());
  const auto all = n + 6 * static_cast<Eigen::Index>(linear.knocks.size());
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(all, all);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(all);
  for (std::size_t row = 0; row + 1 < linear.rows.size(); ++row)
    for (int i = linear.rows[row]; i < linear.rows[row + 1]; ++i) {
      const auto a = static_cast<std::size_t>(i);
      gradient[linear.columns[a]] += linear.values[a] * linear.residuals[static_cast<Eigen::Index>(row)];
      for (int j = linear.rows[row]; j < linear.rows[row + 1]; ++j) {
        const auto b = static_cast<std::size_t>(j);
        information(linear.columns[a], linear.columns[b]) += linear.values[a] * linear.values[b];
      }
    }
  const auto open = [&](Eigen::Index k) {
    throw InputError("joint refinement: the data leaves " + linear.numbers[static_cast<std::size_t>(k)].name + " open");
  };
  const Eigen::VectorXd diagonal = information.diagonal().head(n);
  for (Eigen::Index k = 0; k < n; ++k)
    if (!(diagonal[k] > 0)) open(k);
  const Eigen::VectorXd scale = diagonal.cwiseSqrt().cwiseInverse();
  const Eigen::LLT<Eigen::MatrixXd> factor(scale.asDiagonal() * information.topLeftCorner(n, n) * scale.asDiagonal());
  constexpr double kLeastPivot = 1e-6;
  Eigen::Index least = 0;
  const double pivot = factor.matrixLLT().diagonal().cwiseAbs().minCoeff(&least);
  if (factor.info() != Eigen::Success || !(pivot > kLeastPivot)) open(least);
  Normal out;
  out.covariance = scale.asDiagonal() * factor.solve(Eigen::MatrixXd::Identity(n, n)) * scale.asDiagonal();
  out.knocks = information.bottomRightCorner(all - n, all - n);
  out.across = information.topRightCorner(n, all - n);
  out.gradient = gradient.head(n);
  out.knock_gradient = gradient.tail(all - n);
  return out;
}

/// Variance of a mean of many in a row over that of as many independent ones, from how they go together within each row.
double serial_allowance(const std::vector<std::vector<double>>& rows) {
  double squares = 0;
  std::size_t longest = 0;
  for (const auto& row : rows) {
    longest = std::max(longest, row.size());
    for (const double r : row) squares += r * r;
  }
  if (!(squares > 0)) return 1;
  const std::size_t reach = std::clamp<std::size_t>(longest / 4, 1, 20);
  double factor = 1;
  for (std::size_t lag = 1; lag <= reach; ++lag) {
    double products = 0;
    for (const auto& row : rows)
      for (std::size_t i = 0; i + lag < row.size(); ++i) products += row[i] * row[i + lag];
    factor += 2 * (1 - static_cast<double>(lag) / static_cast<double>(reach + 1)) * products / squares;
  }
  return std::sqrt(std::max(1.0, factor));
}

class JointSolver {
 public:
  explicit JointSolver(const JointProblem& problem)
      : problem_(problem),
        frame_(plane_frame(problem)),
        state_(first_state(problem)),
        groups_(first_groups(problem)),
        at_{problem.boards.cameras.size()} {
    for (const SheetBoard& sheet : problem.sheets) strays_.emplace_back(sheet.stripes.size(), false);
  }

  JointSolution solve() {
    for (int round = 0;; ++round) {
      JointLeastSquares squares(problem_, frame_, groups_, strays_, state_);
      squares.solve();
      linear_ = squares.linear();
      normal_ = normal_of(linear_);
      if (round == kRounds) break;
      weigh();
      find_strays();
    }
    return solution();
  }

 private:
  /// Each group's sigma is that at which its sum of squares is what is left of its freedom.
  void weigh() {
    std::vector<double> squares(groups_.size()), absorbed(groups_.size());
    std::vector<std::size_t> counts(groups_.size());
    for (std::size_t row = 0; row < linear_.group.size(); ++row) {
      if (linear_.group[row] < 0) continue;
      const auto g = static_cast<std::size_t>(linear_.group[row]);
      const double r = linear_.residuals[static_cast<Eigen::Index>(row)];
      squares[g] += r * r, ++counts[g];
      absorbed[g] += linear_.dot(static_cast<int>(row), normal_.covariance);
    }
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      ErrorGroup& group = groups_[g];
      group.measurements = counts[g];
      if (counts[g] == 0) continue;
      const double count = static_cast<double>(counts[g]);
      const double free = std::max(0.02 * count, count - absorbed[g] * group.allowance * group.allowance);
      const double least = g == at_.joints() ? kLeastJoint : kLeast_px;
      group.sigma = std::max(least, group.sigma * group.allowance * std::sqrt(squares[g] / free));
    }
    for (const std::size_t group : {at_.offset(), at_.slope()})
      groups_[group].allowance = serial_allowance(rows_of(group, linear_.residuals));
  }

  /// A group's residuals of stripes, board by board.
  std::vector<std::vector<double>> rows_of(std::size_t group, const Eigen::VectorXd& residuals) const {
    std::vector<std::vector<double>> rows;
    std::size_t row = 0;
    for (const std::vector<bool>& of_sheet : strays_) {
      rows.emplace_back();
      for (std::size_t left = static_cast<std::size_t>(std::count(of_sheet.begin(), of_sheet.end(), false)); left > 0;
           ++row)
        if (linear_.group[row] == static_cast<int>(group))
          rows.back().push_back(residuals[static_cast<Eigen::Index>(row)]), --left;
    }
    return rows;
  }

  Plane plane(const JointState& state) const {
    const Vector3d normal = frame_.normal_of(state.plane.data());
    return {normal, state.plane[2] - normal.dot(frame_.centre)};
  }

  /// How far a stripe's places lie from the laser's plane [m].
  std::array<double, 2> distances(std::size_t sheet, const BoardStripe& stripe) const {
    const double more[4] = {state_.zeros[0] + state_.sweep[0], state_.zeros[1] + state_.sweep[1], state_.zeros[2],
                            state_.zeros[3]};
    const Transform cMt = transform_of(state_.sheets[sheet]),
                    eMc = (transform_of(state_.cMb) * arm_at(problem_.arm, stripe.q, more)).inverse();
    const CameraModel camera = camera_of(problem_.boards.cameras[0], state_.lenses[0]);
    const Plane ePl = plane(state_);
    std::array<double, 2> out{};
    for (std::size_t side = 0; side < 2; ++side) {
      const Vector2d t = on_board(camera, cMt, stripe.pixels[side]);
      out[side] = ePl.distance(eMc * cMt * Vector3d(t.x(), t.y(), 0));
    }
    return out;
  }

  /// All stripes are judged again, by the plane of all together.
  void find_strays() {
    std::vector<double> all;
    std::vector<std::vector<double>> off(problem_.sheets.size());
    for (std::size_t s = 0; s < off.size(); ++s)
      for (const BoardStripe& stripe : problem_.sheets[s].stripes) {
        const auto [a, b] = distances(s, stripe);
        off[s].push_back(std::max(std::abs(a), std::abs(b)));
        all.push_back(off[s].back());
      }
    const double most = kStray * 1.4826 * upper_median(all);
    for (std::size_t s = 0; s < off.size(); ++s)
      for (std::size_t i = 0; i < off[s].size(); ++i) strays_[s][i] = off[s][i] > std::max(most, 1e-9);
  }

  /// Puts into the laser's plane what slew and shoulder were off by in the sweep: a scan's joints read as the sweep's did.
  void fold_sweep(JointState& state) const {
    JointVector q = JointVector::Zero();
    double stripes = 0;
    for (const SheetBoard& sheet : problem_.sheets)
      for (const BoardStripe& stripe : sheet.stripes) q += stripe.q, ++stripes;
    q /= stripes;
    const double more[4] = {state.zeros[0] + state.sweep[0], state.zeros[1] + state.sweep[1], state.zeros[2],
                            state.zeros[3]};
    const Plane ePl =
        arm_at(problem_.arm, q, state.zeros.data()).inverse() * arm_at(problem_.arm, q, more) * plane(state);
    // As numbers about the frame: its normal is n + a u + b v, made a unit.
    const double along = ePl.normal.dot(frame_.normal);
    state.plane = {ePl.normal.dot(frame_.u) / along, ePl.normal.dot(frame_.v) / along, ePl.distance(frame_.centre)};
    state.sweep = {0, 0};
  }

  /// `of`, by the numbers of `state`, by differences.
  Eigen::MatrixXd derivatives(JointState& state, const std::vector<double*>& numbers, const Eigen::VectorXd& sigmas,
                              const std::function<Eigen::VectorXd(const JointState&)>& of) const {
    const Eigen::VectorXd here = of(state);
    Eigen::MatrixXd by(here.size(), static_cast<Eigen::Index>(numbers.size()));
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      const double step = 0.1 * sigmas[at], was = *numbers[k];
      *numbers[k] = was + step;
      const Eigen::VectorXd up = of(state);
      *numbers[k] = was - step;
      const Eigen::VectorXd down = of(state);
      *numbers[k] = was;
      by.col(at) = (up - down) / (2 * step);
    }
    return by;
  }

  JointSolution solution();
  void add_discrepancies(JointSolution& out) const;
  /// Root of what the sum of squares falls by with this change of the numbers; each group weighed by what is left of it then, for a
  /// move that nobody has looked for makes a group's errors look large, and alike from frame to frame.
  double sigmas_better(const Eigen::VectorXd& change) const;
  void add_effects(JointSolution& out, JointState& rig, const std::vector<double*>& numbers,
                   const Eigen::VectorXd& sigmas) const;

  const JointProblem& problem_;
  const PlaneFrame frame_;
  JointState state_;
  std::vector<ErrorGroup> groups_;
  const JointGroups at_;
  std::vector<std::vector<bool>> strays_;
  JointLinear linear_;
  Normal normal_;
};

double JointSolver::sigmas_better(const Eigen::VectorXd& change) const {
  Eigen::VectorXd after = linear_.residuals;
  for (std::size_t row = 0; row + 1 < linear_.rows.size(); ++row)
    for (int i = linear_.rows[row]; i < linear_.rows[row + 1]; ++i) {
      const auto a = static_cast<std::size_t>(i);
      after[static_cast<Eigen::Index>(row)] += linear_.values[a] * change[linear_.columns[a]];
    }
  std::vector<double> was(groups_.size()), left(groups_.size()), count(groups_.size());
  for (std::size_t row = 0; row < linear_.group.size(); ++row) {
    if (linear_.group[row] < 0) continue;
    const auto g = static_cast<std::size_t>(linear_.group[row]);
    const double before = linear_.residuals[static_cast<Eigen::Index>(row)],
                 now = after[static_cast<Eigen::Index>(row)];
    was[g] += before * before, left[g] += now * now, ++count[g];
  }
  double sum = 0;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    // By how much the variance of a group is less: not told by a few numbers, six of which the move may take up.
    constexpr double kEnough = 30;
    double less = 1;
    if (count[g] >= kEnough && left[g] > 0) {
      const bool of_stripes = g == at_.offset() || g == at_.slope();
      const double allowance =
          of_stripes ? serial_allowance(rows_of(g, after)) / serial_allowance(rows_of(g, linear_.residuals)) : 1;
      less = std::min(1.0, left[g] / was[g] * allowance * allowance * count[g] / (count[g] - kPoseStep));
    }
    sum += (was[g] - left[g]) / less;
  }
  return std::sqrt(std::max(0.0, sum));
}

void JointSolver::add_discrepancies(JointSolution& out) const {
  for (std::size_t k = 0; k < linear_.knocks.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(6 * k);
    const Eigen::MatrixXd across = normal_.across.middleCols(at, 6);
    const Eigen::Matrix<double, 6, 6> own = normal_.knocks.block<6, 6>(at, at),
                                      left = own - across.transpose() * normal_.covariance * across;
    const Eigen::Matrix<double, 6, 1> gradient =
        normal_.knock_gradient.segment<6>(at) - across.transpose() * normal_.covariance * normal_.gradient;
    // Freedoms that the other numbers take up tell nothing.
    const Eigen::Matrix<double, 6, 1> scale = own.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> eigen(scale.asDiagonal() * left *
                                                                           scale.asDiagonal());
    Eigen::Matrix<double, 6, 1> step = Eigen::Matrix<double, 6, 1>::Zero();
    for (int i = 0; i < 6; ++i) {
      constexpr double kTakenUp = 1e-6;
      if (!(eigen.eigenvalues()[i] > kTakenUp)) continue;
      const Eigen::Matrix<double, 6, 1> along = scale.asDiagonal() * eigen.eigenvectors().col(i);
      const double slope = along.dot(gradient);
      step -= slope / eigen.eigenvalues()[i] * along;
    }
    Eigen::VectorXd change = Eigen::VectorXd::Zero(normal_.covariance.rows() + normal_.knocks.rows());
    change.head(normal_.covariance.rows()) = -normal_.covariance * across * step;
    change.segment<6>(normal_.covariance.rows() + at) = step;
    Discrepancy& found = out.discrepancies.emplace_back(Discrepancy{linear_.knocks[k], sigmas_better(change), {}, {}});
    // Of camera 0 the stripes tell how their plane has moved: not all six freedoms.
    if (k > 0) found.moved = step.tail<3>().norm(), found.turned = step.head<3>().norm();
  }
  std::stable_sort(out.discrepancies.begin(), out.discrepancies.end(),
                   [](const Discrepancy& a, const Discrepancy& b) { return a.sigmas > b.sigmas; });
}

void JointSolver::add_effects(JointSolution& out, JointState& rig, const std::vector<double*>& numbers,
                              const Eigen::VectorXd& sigmas) const {
  struct Place {
    Vector2d pixel;
    JointVector q;
    std::optional<std::array<Vector2d, 2>> by_eyes;
  };
  std::vector<Place> places;
  const auto camera = [this](const JointState& state, std::size_t k) {
    return camera_of(problem_.boards.cameras[k], state.lenses[k]);
  };
  for (std::size_t s = 0; s < problem_.sheets.size(); ++s)
    for (std::size_t i = 0; i < problem_.sheets[s].stripes.size(); ++i) {
      if (strays_[s][i]) continue;
      const BoardStripe& stripe = problem_.sheets[s].stripes[i];
      for (const Vector2d& pixel : stripe.pixels) {
        Place place{pixel, stripe.q, {}};
        if (rig.kMc.size() >= 3) {
          const Transform cMt = transform_of(rig.sheets[s]);
          const Vector2d t = on_board(camera(rig, 0), cMt, pixel);
          const Vector3d c = cMt * Vector3d(t.x(), t.y(), 0);
          const auto left = camera(rig, 1).project(transform_of(rig.kMc[1]) * c),
                     right = camera(rig, 2).project(transform_of(rig.kMc[2]) * c);
          if (left && right && camera(rig, 1).contains(*left) && camera(rig, 2).contains(*right))
            place.by_eyes = {*left, *right};
        }
        places.push_back(place);
      }
    }
  const auto by_laser = [&](const JointState& state) {
    Eigen::VectorXd all(3 * static_cast<Eigen::Index>(places.size()));
    const Plane ePl = plane(state);
    const CameraModel lens = camera(state, 0);
    const Transform cMb = transform_of(state.cMb);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Plane cPl = cMb * arm_at(problem_.arm, places[i].q, state.zeros.data()) * ePl;
      const Vector3d ray = lens.ray(places[i].pixel.x(), places[i].pixel.y());
      all.segment<3>(3 * static_cast<Eigen::Index>(i)) = -cPl.offset / cPl.normal.dot(ray) * ray;
    }
    return all;
  };
  std::size_t seen = 0;
  for (const Place& place : places) seen += place.by_eyes ? 1 : 0;
  const auto by_eyes = [&](const JointState& state) {
    Eigen::VectorXd all(3 * static_cast<Eigen::Index>(seen));
    Eigen::Index at = 0;
    const Transform lMr = transform_of(state.kMc[1]) * transform_of(state.kMc[2]).inverse();
    const CameraModel left = camera(state, 1), right = camera(state, 2);
    for (const Place& place : places) {
      if (!place.by_eyes) continue;
      const auto& [l, r] = *place.by_eyes;
      all.segment<3>(at) =
          meeting(Vector3d::Zero(), left.ray(l.x(), l.y()), lMr.translation(), lMr.linear() * right.ray(r.x(), r.y()));
      at += 3;
    }
    return all;
  };
  const auto spread = [&](const Eigen::MatrixXd& by, double count) {
    for (std::size_t k = 0; k < out.parameters.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      out.parameters[k].effect = std::max(out.parameters[k].effect, sigmas[at] * by.col(at).norm() / std::sqrt(count));
    }
    return std::sqrt((by * out.covariance).cwiseProduct(by).sum() / count);
  };
  out.laser_sigma = spread(derivatives(rig, numbers, sigmas, by_laser), static_cast<double>(places.size()));
  if (seen > 0) out.stereo_sigma = spread(derivatives(rig, numbers, sigmas, by_eyes), static_cast<double>(seen));
}

JointSolution JointSolver::solution() {
  JointSolution out;
  // The rig's own numbers, with the laser's plane for joints as they read.
  JointState rig = state_;
  fold_sweep(rig);
  std::vector<double*> looked_for, numbers;
  std::vector<Eigen::Index> of_rig;  // and the sweep's joints, which the plane takes up
  for (std::size_t k = 0; k < linear_.numbers.size(); ++k) {
    const JointColumn& column = linear_.numbers[k];
    const bool sweep = column.number == &state_.sweep[0] || column.number == &state_.sweep[1];
    if (!column.of_rig && !sweep) continue;
    looked_for.push_back(column.number);
    of_rig.push_back(static_cast<Eigen::Index>(k));
    if (!column.of_rig) continue;
    out.parameters.push_back({column.name, column.unit, 0, 0, 0, 0});
  }
  const Eigen::MatrixXd covariance = normal_.covariance(of_rig, of_rig);
  const auto values = [this](JointState state) {
    fold_sweep(state);
    std::vector<double> all;
    const auto add = [&](const auto& block) { all.insert(all.end(), block.begin(), block.end()); };
    const std::vector<int> free = free_parameters(problem_.boards.lens);
    for (const CameraParameters& lens : state.lenses)
      for (const int i : free) all.push_back(lens[static_cast<std::size_t>(i)]);
    for (std::size_t k = 1; k < state.kMc.size(); ++k) add(state.kMc[k]);
    add(state.cMb), add(state.eMg);
    for (std::size_t i = 0; i < 4; ++i)
      if (problem_.refined_zeros[i]) all.push_back(state.zeros[i]);
    add(state.plane);
    return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size())));
  };
  const Eigen::VectorXd column_sigmas = covariance.diagonal().cwiseSqrt();
  const Eigen::MatrixXd by = derivatives(state_, looked_for, column_sigmas, values);
  out.covariance = by * covariance * by.transpose();
  const Eigen::VectorXd here = values(state_), sigmas = out.covariance.diagonal().cwiseSqrt();
  constexpr double kWidth = 1.96;
  for (std::size_t k = 0; k < out.parameters.size(); ++k) {
    Estimate& e = out.parameters[k];
    e.value = here[static_cast<Eigen::Index>(k)];
    e.sigma = sigmas[static_cast<Eigen::Index>(k)];
    e.half_width = kWidth * e.sigma;
  }
  // The same numbers in `rig`.
  const std::vector<int> free = free_parameters(problem_.boards.lens);
  const auto add = [&](auto& block) {
    for (double& number : block) numbers.push_back(&number);
  };
  for (CameraParameters& lens : rig.lenses)
    for (const int i : free) numbers.push_back(&lens[static_cast<std::size_t>(i)]);
  for (std::size_t k = 1; k < rig.kMc.size(); ++k) add(rig.kMc[k]);
  add(rig.cMb), add(rig.eMg);
  for (std::size_t i = 0; i < 4; ++i)
    if (problem_.refined_zeros[i]) numbers.push_back(&rig.zeros[i]);
  add(rig.plane);

  const auto pose_covariance = [&](const std::function<Transform(const JointState&)>& of) {
    const Transform here_is = of(rig);
    const Eigen::MatrixXd step = derivatives(rig, numbers, sigmas, [&](const JointState& state) -> Eigen::VectorXd {
      return step_between(here_is, of(state));
    });
    return Eigen::Matrix<double, 6, 6>(step * out.covariance * step.transpose());
  };
  const auto bMk = [](std::size_t k) {
    return [k](const JointState& state) {
      return Transform((transform_of(state.kMc[k]) * transform_of(state.cMb)).inverse());
    };
  };
  out.boards = problem_.boards;
  for (std::size_t k = 0; k < rig.lenses.size(); ++k) {
    out.boards.cameras[k] = camera_of(problem_.boards.cameras[k], rig.lenses[k]);
    out.boards.kMc[k] = transform_of(rig.kMc[k]);
    out.bMk.push_back(bMk(k)(rig));
    out.mount_covariance.push_back(pose_covariance(bMk(k)));
  }
  for (std::size_t v = 0; v < rig.views.size(); ++v) out.boards.cMt[v] = transform_of(rig.views[v]);
  out.boards.bend = {rig.bend[0], rig.bend[1]};
  out.cMb = transform_of(rig.cMb), out.eMg = transform_of(rig.eMg);
  out.gripper_covariance = pose_covariance([](const JointState& state) { return transform_of(state.eMg); });
  out.pair_covariance.setZero();
  if (rig.kMc.size() >= 3) {
    const auto lMr = [](const JointState& state) {
      return Transform(transform_of(state.kMc[1]) * transform_of(state.kMc[2]).inverse());
    };
    out.lMr = lMr(rig);
    out.pair_covariance = pose_covariance(lMr);
  }
  out.arm = problem_.arm;
  for (std::size_t i = 0; i < 4; ++i) out.arm.dh[i].theta0 += rig.zeros[i];
  out.ePl = plane(rig);
  out.centre = frame_.centre, out.axis_u = frame_.u, out.axis_v = frame_.v;
  const Eigen::Index last = sigmas.size() - 1;
  out.sigma_rad = std::max(sigmas[last - 2], sigmas[last - 1]);
  out.sigma_m = sigmas[last];
  add_effects(out, rig, numbers, sigmas);
  double squares = 0;
  for (std::size_t s = 0; s < strays_.size(); ++s)
    for (std::size_t i = 0; i < strays_[s].size(); ++i) {
      if (strays_[s][i]) {
        ++out.strays;
        continue;
      }
      ++out.stripes;
      for (const double off : distances(s, problem_.sheets[s].stripes[i])) squares += off * off / 2;
    }
  out.rms = std::sqrt(squares / static_cast<double>(out.stripes));
  for (const ErrorGroup& group : groups_)
    if (group.measurements > 0) out.groups.push_back(group);
  add_discrepancies(out);
  return out;
}

}  // namespace

BoardBundle seen_from(const BoardBundle& boards, std::size_t camera) {
  BoardBundle out = boards;
  const auto first = static_cast<std::ptrdiff_t>(camera);
  const auto turn = [first](auto& of_cameras) {
    std::rotate(of_cameras.begin(), of_cameras.begin() + first, of_cameras.begin() + first + 1);
  };
  const Transform kMc = boards.kMc[camera], cMk = kMc.inverse();
  for (Transform& iMc : out.kMc) iMc = iMc * cMk;
  out.kMc[camera] = Transform::Identity();
  turn(out.cameras), turn(out.kMc);
  for (BoardView& view : out.views) turn(view.seen);
  for (Transform& cMt : out.cMt) cMt = kMc * cMt;
  return out;
}

const Estimate* JointSolution::parameter(const std::string& name) const {
  const auto found =
      std::find_if(parameters.begin(), parameters.end(), [&](const Estimate& e) { return e.name == name; });
  return found == parameters.end() ? nullptr : &*found;
}

JointSolution solve(const JointProblem& problem) {
  check(problem);
  return JointSolver(problem).solve();
}

}  // namespace tankrig
