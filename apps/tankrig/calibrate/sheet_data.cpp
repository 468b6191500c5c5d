#include "apps/tankrig/calibrate/sheet_data.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "apps/tankrig/calibrate/dark_frames.hpp"
#include "apps/tankrig/calibrate/time_data.hpp"
#include "core/input_error.hpp"
#include "pipeline/reconstruct_session.hpp"

namespace tankrig::app {
namespace {

constexpr double kLeastSheetSigma = 1e-5;  // [m]
constexpr std::size_t kPointsOfAView = 60;

}  // namespace

SheetViews sheet_views(const OpenedSession& opened, const RigCamera& camera, const TargetBoard& board,
                       Progress& progress) {
  const Session& session = opened.session;
  const Checkerboard checkerboard = checkerboard_of(board.pattern, board.square);
  const auto seen = find_checkerboard(dark_picture(session, camera.name), checkerboard, camera.model);
  if (!seen)
    throw InputError(session.path, fmt::format("camera {} does not see all corners of the board `sheet`, expected it "
                                               "whole while the arm rests",
                                               camera.name));
  SheetViews out{*seen, {}};
  const Reconstruction found = reconstruct_session(session, pipeline_parameters(session), "laser", progress.callback());
  std::map<int, StripeLine> stripes;
  for (const StripeRow& row : found.rows) {
    StripeLine& line = stripes[row.frame];
    line.rows = found.orientation == StripeOrientation::kRows;
    line.points.push_back({static_cast<int>(std::lround(row.peak.column)), row.peak.position, row.peak.sigma_px});
  }
  const BoardArea area = area_of(checkerboard);
  const std::vector<TimedJoints> joints = timed_joints(opened);
  for (const FrameRecord& frame : session.frames) {
    if (frame.camera != camera.name || !lit_sweep(frame) || !stripes.contains(frame.index)) continue;
    SheetView view{frame.index, frame.pass, *frame.q, motion_at(joints, frame.stamp).velocity,
                   points_on_board(camera.model, stripes[frame.index], out.board.cMt, area)};
    if (view.points.size() >= kLeastOnSheet) out.views.push_back(std::move(view));
  }
  return out;
}

LaserPlaneProblem sheet_problem(const std::vector<SheetView>& views, const RigConfig& rig, const RigCamera& camera) {
  LaserPlaneProblem problem;
  for (const SheetView& view : views) {
    const Transform eMc = rig.arm.bMe(view.q).inverse() * camera.bMc;
    const int group = static_cast<int>(problem.groups.size());
    problem.groups.push_back({fmt::format("{} frame {}", camera.name, view.frame), view.q[kElbow]});
    const std::size_t step = std::max<std::size_t>(1, view.points.size() / kPointsOfAView);
    for (std::size_t i = 0; i < view.points.size(); i += step) {
      const Vector3d e = eMc * view.points[i].p;
      problem.points.push_back({e, std::max(view.points[i].sigma, kLeastSheetSigma), group});
      if (i == 0) problem.targets.push_back({e, (e - eMc.translation()).normalized()});
    }
  }
  return problem;
}

}  // namespace tankrig::app
