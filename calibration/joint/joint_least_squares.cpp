#include "calibration/joint/joint_least_squares.hpp"

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "calibration/estimate/least_squares.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

/// Numbers that were measured by themselves.
ceres::CostFunction* measured(const ceres::Vector& values, double weight) {
  return new ceres::NormalPrior(weight * ceres::Matrix::Identity(values.size(), values.size()), values);
}

const char* const kPoseNames[]{"rotation x",    "rotation y",    "rotation z",
                               "translation x", "translation y", "translation z"};

}  // namespace

double JointLinear::dot(int row, const Eigen::MatrixXd& between) const {
  double sum = 0;
  const int from = rows[static_cast<std::size_t>(row)], to = rows[static_cast<std::size_t>(row) + 1];
  for (int i = from; i < to; ++i)
    for (int j = from; j < to; ++j) {
      const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
      if (columns[a] < between.rows() && columns[b] < between.cols())
        sum += values[a] * values[b] * between(columns[a], columns[b]);
    }
  return sum;
}

RationalCamera camera_at(const JointProblem& problem, const JointState& state, std::size_t k) {
  RationalCamera camera = camera_of(problem.boards.cameras[k], state.lenses[k]);
  if (camera.port) camera.port = port_of(*camera.port, state.ports[k]);
  return camera;
}

Vector2d on_board(const CameraModel& camera, const Transform& cMt, const Vector2d& pixel) {
  const Transform tMc = cMt.inverse();
  const ViewingRay sight = tMc * camera.sight(pixel.x(), pixel.y());
  return sight.at(-sight.origin.z() / sight.direction.z()).head<2>();
}

JointLeastSquares::JointLeastSquares(const JointProblem& problem, const PlaneFrame& frame,
                                     const std::vector<ErrorGroup>& groups,
                                     const std::vector<std::vector<bool>>& strays, JointState& state)
    : problem_(problem),
      frame_(frame),
      groups_(groups),
      strays_(strays),
      state_(state),
      at_{problem.boards.cameras.size()},
      knocks_(problem.boards.cameras.size()) {
  for (auto& knock : knocks_) knock.fill(0);
  add_boards();
  add_marker();
  add_sheets();
  hold_what_is_not_free();
}

void JointLeastSquares::add(ceres::CostFunction* cost, std::vector<double*> blocks,
                            const std::vector<std::size_t>& groups) {
  for (int row = 0; row < cost->num_residuals(); ++row)
    group_of_row_.push_back(static_cast<int>(groups[static_cast<std::size_t>(row) % groups.size()]));
  ceres_.AddResidualBlock(cost, nullptr, blocks);
}

std::vector<int> JointLeastSquares::free_of_lens() const {
  return problem_.boards.lens_held ? std::vector<int>() : free_parameters(problem_.boards.lens);
}

void JointLeastSquares::add_boards() {
  const BoardBundle& boards = problem_.boards;
  const std::vector<Vector3d> points = boards.target.points();
  const std::vector<Vector2d> shapes = bend_shapes(boards.target);
  for (std::size_t v = 0; v < boards.views.size(); ++v)
    for (std::size_t k = 0; k < boards.cameras.size(); ++k) {
      const FoundBoard& board = boards.views[v].seen[k];
      for (std::size_t i = 0; i < board.ids.size(); ++i) {
        const auto id = static_cast<std::size_t>(board.ids[i]);
        add(new BoardCorner(points[id], shapes[id], board.pixels[i], boards.cameras[k].port, weight(at_.boards(k))),
            {state_.lenses[k].data(), state_.ports[k].data(), state_.kMc[k].data(), state_.views[v].data(),
             state_.bend.data()},
            {at_.boards(k)});
      }
    }
}

void JointLeastSquares::add_marker() {
  for (std::size_t v = 0; v < problem_.postures.size(); ++v) {
    const MarkerPosture& posture = problem_.postures[v];
    for (std::size_t k = 0; k < posture.seen.size(); ++k) {
      if (posture.seen[k].points.empty()) continue;
      auto* const marker =
          new MarkerInPicture{&problem_.arm, &posture, k, problem_.boards.cameras[k].port, weight(at_.marker(k))};
      add(new ceres::AutoDiffCostFunction<MarkerInPicture, ceres::DYNAMIC, kCameraParameters, kPortParameters, 6, 6, 6,
                                          4, 4, 6>(marker, 2 * static_cast<int>(posture.seen[k].points.size())),
          {state_.lenses[k].data(), state_.ports[k].data(), state_.kMc[k].data(), state_.cMb.data(), state_.eMg.data(),
           state_.zeros.data(), state_.joints[v].data(), k == 0 ? no_knock_.data() : knocks_[k].data()},
          {at_.marker(k)});
    }
    add(measured(ceres::Vector::Zero(4), weight(at_.joints())), {state_.joints[v].data()}, {at_.joints()});
  }
}

void JointLeastSquares::add_sheets() {
  const RationalCamera camera = camera_at(problem_, state_, 0);
  for (std::size_t s = 0; s < problem_.sheets.size(); ++s) {
    const SheetBoard& sheet = problem_.sheets[s];
    for (std::size_t i = 0; i < sheet.points.size(); ++i)
      add(new BoardCorner(sheet.points[i], Vector2d::Zero(), sheet.corners[i], camera.port, weight(at_.corners())),
          {state_.lenses[0].data(), state_.ports[0].data(), state_.kMc[0].data(), state_.sheets[s].data(),
           no_bend_.data()},
          {at_.corners()});
    const Transform cMt = transform_of(state_.sheets[s]);
    for (std::size_t i = 0; i < sheet.stripes.size(); ++i) {
      if (strays_[s][i]) continue;
      StripeInPicture error{&problem_.arm,        &sheet.stripes[i],  &frame_, camera.port, {}, {}, {},
                            weight(at_.offset()), weight(at_.slope())};
      for (std::size_t side = 0; side < 2; ++side)
        error.on_board[side] = on_board(camera, cMt, sheet.stripes[i].pixels[side]);
      const Vector2d along_t = error.on_board[1] - error.on_board[0],
                     along_px = sheet.stripes[i].pixels[1] - sheet.stripes[i].pixels[0];
      error.across_t = Vector2d(-along_t.y(), along_t.x()).normalized();
      error.across_px = Vector2d(-along_px.y(), along_px.x()).normalized();
      add(new ceres::AutoDiffCostFunction<StripeInPicture, 2, kCameraParameters, kPortParameters, 6, 6, 4, 3, 2, 1, 6>(
              new StripeInPicture(error)),
          {state_.lenses[0].data(), state_.ports[0].data(), state_.sheets[s].data(), state_.cMb.data(),
           state_.zeros.data(), state_.plane.data(), state_.sweep.data(), &state_.delay, knocks_[0].data()},
          {at_.offset(), at_.slope()});
    }
  }
  // Joints at rest err as they do in any posture.
  ceres_.AddResidualBlock(measured(ceres::Vector::Zero(2), weight(at_.joints())), nullptr, state_.sweep.data());
  group_of_row_.insert(group_of_row_.end(), 2, -1);
  if (const auto& swept = problem_.delay) {
    ceres_.AddResidualBlock(measured(ceres::Vector::Constant(1, swept->value), kWidth / swept->half_width), nullptr,
                            &state_.delay);
    group_of_row_.push_back(-1);
  }
}

void JointLeastSquares::hold_what_is_not_free() {
  const auto hold = [this](double* block, int size, const std::vector<int>& held) {
    if (!ceres_.HasParameterBlock(block)) return;
    if (static_cast<int>(held.size()) == size)
      ceres_.SetParameterBlockConstant(block);
    else if (!held.empty())
      ceres_.SetManifold(block, new ceres::SubsetManifold(size, held));
  };
  const std::vector<int> free = free_of_lens();
  std::vector<int> lens, zeros;
  for (int i = 0; i < kCameraParameters; ++i)
    if (std::find(free.begin(), free.end(), i) == free.end()) lens.push_back(i);
  for (int i = 0; i < 4; ++i)
    if (!problem_.refined_zeros[static_cast<std::size_t>(i)]) zeros.push_back(i);
  for (CameraParameters& of : state_.lenses) hold(of.data(), kCameraParameters, lens);
  for (std::size_t k = 0; k < state_.ports.size(); ++k)
    if (!problem_.boards.cameras[k].port) hold(state_.ports[k].data(), kPortParameters, {0, 1, 2});
  hold(state_.zeros.data(), 4, zeros);
  hold(state_.kMc[0].data(), 6, {0, 1, 2, 3, 4, 5});
  if (!problem_.boards.bends) hold(state_.bend.data(), 2, {0, 1});
  for (auto& knock : knocks_) hold(knock.data(), 6, {0, 1, 2, 3, 4, 5});
  hold(no_knock_.data(), 6, {0, 1, 2, 3, 4, 5});
  hold(no_bend_.data(), 2, {0, 1});
}

void JointLeastSquares::solve() {
  ceres::Solver::Summary summary;
  ceres::Solve(solver_options(ceres::DENSE_SCHUR), &ceres_, &summary);
  if (!summary.IsSolutionUsable() || !std::isfinite(summary.final_cost))
    throw InputError(fmt::format("joint refinement: found no minimum ({})", summary.message));
}

JointLinear JointLeastSquares::linear() {
  JointLinear out;
  ceres::Problem::EvaluateOptions options;
  options.apply_loss_function = false;
  options.num_threads = 1;
  using Block = std::function<double*(JointState&)>;
  const auto block = [&](const Block& of, const std::vector<int>& free, JointColumn::Of kind, const auto& name_of,
                         const auto& unit_of) {
    double* const numbers = of(state_);
    if (free.empty() || !ceres_.HasParameterBlock(numbers)) return;
    options.parameter_blocks.push_back(numbers);
    for (const int i : free) out.numbers.push_back({name_of(i), unit_of(i), kind, of, i});
  };
  const auto pose = [&](const Block& of, const std::string& name, JointColumn::Of kind) {
    block(
        of, {0, 1, 2, 3, 4, 5}, kind, [&](int i) { return name + " " + kPoseNames[i]; },
        [](int i) { return std::string(i < 3 ? "rad" : "m"); });
  };
  const auto named = [](const std::string& name) { return [name](int) { return name; }; };
  for (std::size_t k = 0; k < state_.lenses.size(); ++k)
    block([k](JointState& s) { return s.lenses[k].data(); }, free_of_lens(), JointColumn::kRig,
          [&](int i) { return problem_.cameras[k] + " " + kCameraParameterNames[static_cast<std::size_t>(i)]; },
          [](int i) { return unit_of(static_cast<std::size_t>(i)); });
  for (std::size_t k = 0; k < state_.ports.size(); ++k)
    if (problem_.boards.cameras[k].port)
      block([k](JointState& s) { return s.ports[k].data(); }, {0, 1, 2}, JointColumn::kRig,
            [&](int i) { return problem_.cameras[k] + " " + kPortParameterNames[static_cast<std::size_t>(i)]; },
            [](int i) { return unit_of_port(static_cast<std::size_t>(i)); });
  for (std::size_t k = 1; k < state_.kMc.size(); ++k)
    pose([k](JointState& s) { return s.kMc[k].data(); }, problem_.cameras[0] + " in " + problem_.cameras[k],
         JointColumn::kRig);
  pose([](JointState& s) { return s.cMb.data(); }, "base in " + problem_.cameras[0], JointColumn::kRig);
  pose([](JointState& s) { return s.eMg.data(); }, "marker in gripper", JointColumn::kRig);
  std::vector<int> zeros;
  for (int i = 0; i < 4; ++i)
    if (problem_.refined_zeros[static_cast<std::size_t>(i)]) zeros.push_back(i);
  block([](JointState& s) { return s.zeros.data(); }, zeros, JointColumn::kRig,
        [](int i) { return std::string(kJointNames[static_cast<std::size_t>(i)]) + " zero"; }, named("rad"));
  block([](JointState& s) { return s.plane.data(); }, {0, 1, 2}, JointColumn::kRig,
        [](int i) { return std::string(kPlaneNames[static_cast<std::size_t>(i)]); },
        [](int i) { return std::string(i < 2 ? "rad" : "m"); });
  block([](JointState& s) { return &s.delay; }, {0}, JointColumn::kRig, named(problem_.cameras[0] + " delay"),
        named("s"));
  block([](JointState& s) { return s.sweep.data(); }, {0, 1}, JointColumn::kSweep,
        [](int i) { return std::string(i == 0 ? "slew" : "shoulder") + " in the sweep"; }, named("rad"));
  if (problem_.boards.bends)
    block([](JointState& s) { return s.bend.data(); }, {0, 1}, JointColumn::kPicture, named("the target's bend"),
          named("m"));
  for (std::size_t v = 0; v < state_.views.size(); ++v)
    pose([v](JointState& s) { return s.views[v].data(); }, problem_.boards.views[v].name, JointColumn::kPicture);
  for (std::size_t i = 0; i < state_.sheets.size(); ++i)
    pose([i](JointState& s) { return s.sheets[i].data(); }, problem_.sheets[i].name, JointColumn::kPicture);
  for (std::size_t v = 0; v < state_.joints.size(); ++v)
    block([v](JointState& s) { return s.joints[v].data(); }, {0, 1, 2, 3}, JointColumn::kPicture,
          named("joints of " + problem_.postures[v].name), named("rad"));
  for (std::size_t k = 0; k < knocks_.size(); ++k) {
    if (!ceres_.HasParameterBlock(knocks_[k].data())) continue;
    ceres_.SetParameterBlockVariable(knocks_[k].data());
    options.parameter_blocks.push_back(knocks_[k].data());
    out.knocks.push_back(k == 0 ? problem_.cameras[0] + ", or the arm, between marker and sheet"
                                : problem_.cameras[k] + ", between boards and marker");
  }
  std::vector<double> residuals;
  ceres::CRSMatrix jacobian;
  ceres_.Evaluate(options, nullptr, &residuals, nullptr, &jacobian);
  for (auto& knock : knocks_)
    if (ceres_.HasParameterBlock(knock.data())) ceres_.SetParameterBlockConstant(knock.data());
  out.residuals = Eigen::Map<const Eigen::VectorXd>(residuals.data(), static_cast<Eigen::Index>(residuals.size()));
  out.group = group_of_row_;
  out.rows = std::move(jacobian.rows);
  out.columns = std::move(jacobian.cols);
  out.values = std::move(jacobian.values);
  return out;
}

}  // namespace tankrig
