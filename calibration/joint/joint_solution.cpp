// What a fit says of the rig: its numbers with their covariance, and how far places are off for it.
#include <algorithm>
#include <cmath>
#include <functional>

#include "calibration/estimate/differentiable.hpp"
#include "calibration/joint/joint_fit.hpp"
#include "core/ray_meeting.hpp"

namespace tankrig {
namespace {

/// Puts into the laser's plane what slew and shoulder were off by in the sweep: a scan's joints read as the sweep's did.
void fold_sweep(const JointFit& fit, JointState& state) {
  JointVector q = JointVector::Zero();
  double stripes = 0;
  for (const SheetBoard& sheet : fit.problem.sheets)
    for (const BoardStripe& stripe : sheet.stripes) q += stripe.q, ++stripes;
  q /= stripes;
  const auto more = beyond_reading(state.zeros.data(), state.sweep.data(), 0.0, JointVector::Zero());
  const ArmModel& arm = fit.problem.arm;
  const Plane ePl = arm_at(arm, q, state.zeros.data()).inverse() * arm_at(arm, q, more.data()) * fit.plane(state);
  // As numbers about the frame: its normal is n + a u + b v, made a unit.
  const PlaneFrame& frame = fit.frame;
  const double along = ePl.normal.dot(frame.normal);
  state.plane = {ePl.normal.dot(frame.u) / along, ePl.normal.dot(frame.v) / along, ePl.distance(frame.centre)};
  state.sweep = {0, 0};
}

using Columns = std::vector<const JointColumn*>;

Columns columns_of(const JointLinear& linear, JointColumn::Of of) {
  Columns out;
  for (const JointColumn& column : linear.numbers)
    if (column.of == of) out.push_back(&column);
  return out;
}

/// `of`, by the numbers in `columns`, by differences.
Eigen::MatrixXd derivatives(JointState state, const Columns& columns, const Eigen::VectorXd& sigmas,
                            const std::function<Eigen::VectorXd(const JointState&)>& of) {
  const Eigen::VectorXd here = of(state);
  Eigen::MatrixXd by(here.size(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    double& number = columns[k]->in(state);
    const double step = 0.1 * sigmas[at], was = number;
    number = was + step;
    const Eigen::VectorXd up = of(state);
    number = was - step;
    const Eigen::VectorXd down = of(state);
    number = was;
    by.col(at) = (up - down) / (2 * step);
  }
  return by;
}

/// The rig's own numbers, with the laser's plane for joints as they read.
struct RigNumbers {
  JointState state;
  Columns columns;
  Eigen::MatrixXd covariance;
  Eigen::VectorXd sigmas, widths;  ///< widths: half of the 95 % intervals'

  Eigen::MatrixXd by(const std::function<Eigen::VectorXd(const JointState&)>& of) const {
    return derivatives(state, columns, sigmas, of);
  }
  Eigen::Matrix<double, 6, 6> pose_covariance(const std::function<Transform(const JointState&)>& of) const {
    const Transform here = of(state);
    const Eigen::MatrixXd step =
        by([&](const JointState& numbers) -> Eigen::VectorXd { return step_between(here, of(numbers)); });
    return step * covariance * step.transpose();
  }
};

RigNumbers rig_numbers(const JointFit& fit) {
  RigNumbers out{fit.state, columns_of(fit.linear, JointColumn::kRig), {}, {}, {}};
  fold_sweep(fit, out.state);
  // And the sweep's joints, which the plane takes up.
  Columns looked_for = out.columns;
  const Columns sweep = columns_of(fit.linear, JointColumn::kSweep);
  looked_for.insert(looked_for.end(), sweep.begin(), sweep.end());
  std::vector<Eigen::Index> at;
  for (const JointColumn* column : looked_for) at.push_back(column - fit.linear.numbers.data());
  const Eigen::MatrixXd covariance = fit.normal.covariance(at, at);
  const auto folded = [&](JointState state) {
    fold_sweep(fit, state);
    Eigen::VectorXd all(static_cast<Eigen::Index>(out.columns.size()));
    for (std::size_t k = 0; k < out.columns.size(); ++k) all[static_cast<Eigen::Index>(k)] = out.columns[k]->in(state);
    return all;
  };
  const Eigen::MatrixXd by = derivatives(fit.state, looked_for, covariance.diagonal().cwiseSqrt(), folded);
  out.covariance = by * covariance * by.transpose();
  const DelaySpread spread = delay_spread(fit);
  const auto delay =
      std::find_if(out.columns.begin(), out.columns.end(), [](const auto* c) { return c->unit == "s"; }) -
      out.columns.begin();
  const double wider = spread.sigma / std::sqrt(out.covariance(delay, delay));
  out.covariance.row(delay) *= wider, out.covariance.col(delay) *= wider;
  out.sigmas = out.covariance.diagonal().cwiseSqrt();
  out.widths = kWidth * out.sigmas;
  out.widths[delay] = interval_factor(spread.freedom) * spread.sigma;
  return out;
}

void add_parameters(const RigNumbers& rig, JointSolution& out) {
  JointState state = rig.state;
  for (std::size_t k = 0; k < rig.columns.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    out.parameters.push_back(
        {rig.columns[k]->name, rig.columns[k]->unit, rig.columns[k]->in(state), rig.sigmas[at], rig.widths[at], 0});
  }
  out.covariance = rig.covariance;
}

/// How far places on the stripes are off along the rays, by laser and by stereo, and what each number has to do with it.
void add_effects(const JointFit& fit, const RigNumbers& rig, JointSolution& out) {
  struct Place {
    Vector2d pixel;
    JointVector q, velocity;
    std::optional<std::array<Vector2d, 2>> by_eyes;
  };
  std::vector<Place> places;
  const bool eyes = rig.state.kMc.size() >= 3;
  const CameraModel first = camera_at(fit.problem, rig.state, 0);
  for (std::size_t s = 0; s < fit.problem.sheets.size(); ++s)
    for (std::size_t i = 0; i < fit.problem.sheets[s].stripes.size(); ++i) {
      if (fit.strays[s][i]) continue;
      const BoardStripe& stripe = fit.problem.sheets[s].stripes[i];
      for (const Vector2d& pixel : stripe.pixels) {
        Place place{pixel, stripe.q, stripe.velocity, {}};
        if (eyes) {
          const CameraModel in_left = camera_at(fit.problem, rig.state, 1),
                            in_right = camera_at(fit.problem, rig.state, 2);
          const Transform cMt = transform_of(rig.state.sheets[s]);
          const Vector2d t = on_board(first, cMt, pixel);
          const Vector3d c = cMt * Vector3d(t.x(), t.y(), 0);
          const auto left = in_left.project(transform_of(rig.state.kMc[1]) * c),
                     right = in_right.project(transform_of(rig.state.kMc[2]) * c);
          if (left && right && in_left.contains(*left) && in_right.contains(*right)) place.by_eyes = {*left, *right};
        }
        places.push_back(place);
      }
    }
  const auto by_laser = [&](const JointState& state) {
    Eigen::VectorXd all(3 * static_cast<Eigen::Index>(places.size()));
    const Plane ePl = fit.plane(state);
    const CameraModel lens = camera_at(fit.problem, state, 0);
    const Transform cMb = transform_of(state.cMb);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto more = beyond_reading(state.zeros.data(), state.sweep.data(), state.delay, places[i].velocity);
      const Plane cPl = cMb * arm_at(fit.problem.arm, places[i].q, more.data()) * ePl;
      const ViewingRay sight = lens.sight(places[i].pixel.x(), places[i].pixel.y());
      all.segment<3>(3 * static_cast<Eigen::Index>(i)) =
          sight.at(-cPl.distance(sight.origin) / cPl.normal.dot(sight.direction));
    }
    return all;
  };
  const auto seen = std::count_if(places.begin(), places.end(), [](const Place& place) { return place.by_eyes; });
  const auto by_eyes = [&](const JointState& state) {
    Eigen::VectorXd all(3 * static_cast<Eigen::Index>(seen));
    Eigen::Index at = 0;
    const Transform lMr = transform_of(state.kMc[1]) * transform_of(state.kMc[2]).inverse();
    const CameraModel left = camera_at(fit.problem, state, 1), right = camera_at(fit.problem, state, 2);
    for (const Place& place : places) {
      if (!place.by_eyes) continue;
      const auto& [l, r] = *place.by_eyes;
      all.segment<3>(at) = meeting(left.sight(l.x(), l.y()), lMr * right.sight(r.x(), r.y()));
      at += 3;
    }
    return all;
  };
  const auto spread = [&](const Eigen::MatrixXd& by, double count) {
    for (std::size_t k = 0; k < out.parameters.size(); ++k) {
      Estimate& e = out.parameters[k];
      e.effect = std::max(e.effect, e.sigma * by.col(static_cast<Eigen::Index>(k)).norm() / std::sqrt(count));
    }
    return std::sqrt((by * out.covariance).cwiseProduct(by).sum() / count);
  };
  out.laser_sigma = spread(rig.by(by_laser), static_cast<double>(places.size()));
  if (seen > 0) out.stereo_sigma = spread(rig.by(by_eyes), static_cast<double>(seen));
}

void add_poses(const JointFit& fit, const RigNumbers& rig, JointSolution& out) {
  const JointState& found = rig.state;
  out.boards = fit.problem.boards;
  for (std::size_t k = 0; k < found.lenses.size(); ++k) {
    const auto bMk = [k](const JointState& state) {
      return Transform((transform_of(state.kMc[k]) * transform_of(state.cMb)).inverse());
    };
    out.boards.cameras[k] = camera_at(fit.problem, found, k);
    out.boards.kMc[k] = transform_of(found.kMc[k]);
    out.bMk.push_back(bMk(found));
    out.mount_covariance.push_back(rig.pose_covariance(bMk));
  }
  for (std::size_t v = 0; v < found.views.size(); ++v) out.boards.cMt[v] = transform_of(found.views[v]);
  out.boards.bend = {found.bend[0], found.bend[1]};
  out.cMb = transform_of(found.cMb), out.eMg = transform_of(found.eMg);
  out.gripper_covariance = rig.pose_covariance([](const JointState& state) { return transform_of(state.eMg); });
  out.pair_covariance.setZero();
  if (found.kMc.size() >= 3) {
    const auto lMr = [](const JointState& state) {
      return Transform(transform_of(state.kMc[1]) * transform_of(state.kMc[2]).inverse());
    };
    out.lMr = lMr(found);
    out.pair_covariance = rig.pose_covariance(lMr);
  }
  out.arm = fit.problem.arm;
  for (std::size_t i = 0; i < 4; ++i) out.arm.dh[i].theta0 += found.zeros[i];
}

void add_laser(const JointFit& fit, const RigNumbers& rig, JointSolution& out) {
  out.ePl = fit.plane(rig.state);
  out.centre = fit.frame.centre, out.axis_u = fit.frame.u, out.axis_v = fit.frame.v;
  const auto sigma = [&out](std::size_t i) { return out.parameter(kPlaneNames[i])->sigma; };
  out.sigma_rad = std::max(sigma(0), sigma(1));
  out.sigma_m = sigma(2);
  double squares = 0;
  for (std::size_t s = 0; s < fit.strays.size(); ++s)
    for (std::size_t i = 0; i < fit.strays[s].size(); ++i) {
      if (fit.strays[s][i]) {
        ++out.strays;
        continue;
      }
      ++out.stripes;
      for (const double off : fit.distances(s, fit.problem.sheets[s].stripes[i])) squares += off * off / 2;
    }
  out.rms = std::sqrt(squares / static_cast<double>(out.stripes));
}

}  // namespace

JointSolution solution_of(const JointFit& fit) {
  JointSolution out;
  const RigNumbers rig = rig_numbers(fit);
  add_parameters(rig, out);
  add_poses(fit, rig, out);
  add_laser(fit, rig, out);
  add_effects(fit, rig, out);
  for (const ErrorGroup& group : fit.groups)
    if (group.measurements > 0) out.groups.push_back(group);
  out.discrepancies = discrepancies_of(fit);
  return out;
}

}  // namespace tankrig
