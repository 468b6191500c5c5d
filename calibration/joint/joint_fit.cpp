#include "calibration/joint/joint_fit.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/joint/joint_start.hpp"
#include "core/median.hpp"

namespace tankrig {
namespace {

constexpr double kLeastJoint = 1e-8;
constexpr int kRounds = 6;
constexpr double kStray = 5;  // robust standard deviations of a stripe from the plane

}  // namespace

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

JointFit::JointFit(const JointProblem& of)
    : problem(of),
      frame(plane_frame(of)),
      state(first_state(of)),
      groups(first_groups(of)),
      at{of.boards.cameras.size()} {
  for (const SheetBoard& sheet : problem.sheets) strays.emplace_back(sheet.stripes.size(), false);
  for (int round = 0;; ++round) {
    JointLeastSquares squares(problem, frame, groups, strays, state);
    squares.solve();
    linear = squares.linear();
    normal = normal_of(linear);
    if (round == kRounds) break;
    weigh();
    find_strays();
  }
}

/// Each group's sigma is that at which its sum of squares is what is left of its freedom.
void JointFit::weigh() {
  std::vector<double> squares(groups.size()), absorbed(groups.size());
  std::vector<std::size_t> counts(groups.size());
  for (std::size_t row = 0; row < linear.group.size(); ++row) {
    if (linear.group[row] < 0) continue;
    const auto g = static_cast<std::size_t>(linear.group[row]);
    const double r = linear.residuals[static_cast<Eigen::Index>(row)];
    squares[g] += r * r, ++counts[g];
    absorbed[g] += linear.dot(static_cast<int>(row), normal.covariance);
  }
  for (std::size_t g = 0; g < groups.size(); ++g) {
    ErrorGroup& group = groups[g];
    group.measurements = counts[g];
    if (counts[g] == 0) continue;
    const double count = static_cast<double>(counts[g]);
    const double free = std::max(0.02 * count, count - absorbed[g] * group.allowance * group.allowance);
    const double least = g == at.joints() ? kLeastJoint : kLeast_px;
    group.sigma = std::max(least, group.sigma * group.allowance * std::sqrt(squares[g] / free));
  }
  for (const std::size_t group : {at.offset(), at.slope()})
    groups[group].allowance = serial_allowance(rows_of(group, linear.residuals));
}

std::vector<std::vector<double>> JointFit::rows_of(std::size_t group, const Eigen::VectorXd& residuals) const {
  std::vector<std::vector<double>> rows;
  std::size_t row = 0;
  for (const std::vector<bool>& of_sheet : strays) {
    rows.emplace_back();
    for (std::size_t left = static_cast<std::size_t>(std::count(of_sheet.begin(), of_sheet.end(), false)); left > 0;
         ++row)
      if (linear.group[row] == static_cast<int>(group))
        rows.back().push_back(residuals[static_cast<Eigen::Index>(row)]), --left;
  }
  return rows;
}

Plane JointFit::plane(const JointState& numbers) const {
  const Vector3d across = frame.normal_of(numbers.plane.data());
  return {across, numbers.plane[2] - across.dot(frame.centre)};
}

std::array<double, 2> JointFit::distances(std::size_t sheet, const BoardStripe& stripe) const {
  const auto more = beyond_reading(state.zeros.data(), state.sweep.data(), state.delay, stripe.velocity);
  const Transform cMt = transform_of(state.sheets[sheet]),
                  eMc = (transform_of(state.cMb) * arm_at(problem.arm, stripe.q, more.data())).inverse();
  const CameraModel lens = camera_at(problem, state, 0);
  const Plane ePl = plane(state);
  std::array<double, 2> out{};
  for (std::size_t side = 0; side < 2; ++side) {
    const Vector2d t = on_board(lens, cMt, stripe.pixels[side]);
    out[side] = ePl.distance(eMc * cMt * Vector3d(t.x(), t.y(), 0));
  }
  return out;
}

/// All stripes are judged again, by the plane of all together.
void JointFit::find_strays() {
  std::vector<double> all;
  std::vector<std::vector<double>> off(problem.sheets.size());
  for (std::size_t s = 0; s < off.size(); ++s)
    for (const BoardStripe& stripe : problem.sheets[s].stripes) {
      const auto [a, b] = distances(s, stripe);
      off[s].push_back(std::max(std::abs(a), std::abs(b)));
      all.push_back(off[s].back());
    }
  const double most = kStray * 1.4826 * upper_median(all);
  for (std::size_t s = 0; s < off.size(); ++s)
    for (std::size_t i = 0; i < off[s].size(); ++i) strays[s][i] = off[s][i] > std::max(most, 1e-9);
}

}  // namespace tankrig
