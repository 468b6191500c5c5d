#include "apps/tankrig/calibrate_all/session_problems.hpp"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <map>
#include <set>

#include "apps/tankrig/calibrate/time_data.hpp"
#include "apps/tankrig/calibrate_all/step_session.hpp"
#include "calibration/laser_plane/checkerboard.hpp"
#include "core/input_error.hpp"
#include "pipeline/reconstruct_session.hpp"
#include "reconstruction/stripe/stripe_detector.hpp"
#include "rig/sync/joint_history.hpp"

namespace tankrig::app {
namespace {

constexpr std::size_t kLeastOnSheet = 30;  // stripe points of one frame
constexpr double kLeastSheetSigma = 1e-5;  // [m]
constexpr std::size_t kHeldBack = 5;
constexpr std::size_t kEveryPair = 4, kPointsOfAView = 60;
constexpr Duration kSameMoment = std::chrono::milliseconds(2), kMostJointGap = std::chrono::milliseconds(100);

/// Corners along three lines of the grid, both ways: what a pose needs.
bool spreads(const FoundBoard& board, const BoardTarget& target) {
  std::set<int> rows, columns;
  for (const int id : board.ids) rows.insert(id / target.columns), columns.insert(id % target.columns);
  return rows.size() >= 3 && columns.size() >= 3;
}

}  // namespace

bool held_back(std::size_t picture) { return picture % kHeldBack == kHeldBack - 1; }

std::vector<std::optional<BoardPicture>> boards_seen(const Session& session, const std::string& camera,
                                                     const BoardTarget& target, Progress& progress) {
  const auto passes = dark_frames_by_pass(session, camera);
  std::vector<std::optional<BoardPicture>> seen(passes.size());
  std::atomic<std::size_t> done = 0;
  tbb::parallel_for(std::size_t{0}, passes.size(), [&](std::size_t k) {
    if (!passes[k].empty()) {
      const BoardSearch search = find_board(grey_of(session.image(*passes[k].front())), target);
      if (search.board && spreads(*search.board, target))
        seen[k] = BoardPicture{passes[k].front()->file, *search.board};
    }
    progress.update("looking for the board: " + camera,
                    static_cast<double>(++done) / static_cast<double>(passes.size()));
  });
  return seen;
}

std::vector<HandEyeView> marker_views(const Session& session, const RigCamera& camera, const GripperMarker& marker,
                                      Progress& progress) {
  const MarkerFinder finder(marker);
  std::vector<HandEyeView> views;
  const auto passes = dark_frames_by_pass(session, camera.name);
  for (std::size_t k = 0; k < passes.size(); ++k) {
    progress.update("looking for the marker: " + camera.name,
                    static_cast<double>(k) / static_cast<double>(passes.size()));
    if (passes[k].empty() || !passes[k].front()->q) continue;
    const SeenMarker seen = finder.find(grey_of(mean_picture(session, passes[k])));
    const auto pose = seen.points.size() < 4 ? std::nullopt : planar_pose(camera.model, seen);
    if (!pose) continue;
    HandEyeView view;
    view.name = passes[k].front()->file;
    view.q = passes[k].front()->q;
    view.points = seen.points;
    view.corners = seen.corners;
    view.cMg = pose->cMg;
    view.cMg_flipped = pose->flipped;
    views.push_back(std::move(view));
  }
  return views;
}

cv::Mat dark_picture(const Session& session, const std::string& camera) {
  std::vector<const FrameRecord*> dark;
  for (const auto& pass : dark_frames_by_pass(session, camera)) dark.insert(dark.end(), pass.begin(), pass.end());
  if (dark.empty())
    throw InputError(session.path, "holds no frames of camera " + camera + " in the dark, expected some");
  return mean_picture(session, dark);
}

SheetViews sheet_views(const OpenedSession& opened, const RigCamera& camera, const TargetBoard& board,
                       Progress& progress) {
  const Session& session = opened.session;
  const Checkerboard checkerboard = checkerboard_of(board.pattern, board.square);
  const auto seen = find_checkerboard(dark_picture(session, camera.name), checkerboard, camera.model);
  if (!seen)
    throw InputError(session.path, fmt::format("camera {} does not see all corners of the board `sheet`, expected it "
                                               "whole while the arm rests",
                                               camera.name));
  SheetViews out{seen->cMt, seen->rms, {}};
  const Reconstruction found = reconstruct_session(session, pipeline_parameters(session), "laser", progress.callback());
  std::map<int, StripeLine> stripes;
  for (const StripeRow& row : found.rows) {
    StripeLine& line = stripes[row.frame];
    line.rows = found.orientation == StripeOrientation::kRows;
    line.points.push_back({static_cast<int>(std::lround(row.peak.column)), row.peak.position, row.peak.sigma_px});
  }
  const BoardArea area = area_of(checkerboard);
  for (const FrameRecord& frame : session.frames) {
    if (frame.camera != camera.name || !lit_sweep(frame) || !stripes.contains(frame.index)) continue;
    SheetView view{frame.index, frame.pass, *frame.q,
                   points_on_board(camera.model, stripes[frame.index], out.cMt, area)};
    if (view.points.size() >= kLeastOnSheet) out.views.push_back(std::move(view));
  }
  return out;
}

std::vector<SheetView> stereo_views(const OpenedSession& opened, const RigCamera& left, const RigCamera& right,
                                    Duration late, Progress& progress) {
  const Session& session = opened.session;
  const auto lit = [&](const RigCamera& camera) {
    std::vector<const FrameRecord*> frames;
    for (const FrameRecord& frame : session.frames)
      if (frame.camera == camera.name && lit_sweep(frame)) frames.push_back(&frame);
    return frames;
  };
  const auto dark = [&](const RigCamera& camera) {
    std::vector<cv::Mat> pictures;
    for (const auto& pass : dark_frames_by_pass(session, camera.name))
      for (const FrameRecord* frame : pass) pictures.push_back(session.image(*frame));
    return median_background(pictures);
  };
  const std::vector<const FrameRecord*> in_left = lit(left), in_right = lit(right);
  const cv::Mat left_dark = dark(left), right_dark = dark(right);
  JointHistory joints(opened.joints.size(), kMostJointGap);
  for (const JointState& state : opened.joints) joints.push(state);
  const Transform cMr = left.bMc.inverse() * right.bMc;
  // Every fourth pair says as much as a plane needs.
  std::vector<SheetView> all((in_left.size() + kEveryPair - 1) / kEveryPair);
  std::atomic<std::size_t> done = 0;
  tbb::parallel_for(std::size_t{0}, all.size(), [&](std::size_t k) {
    const FrameRecord& frame = *in_left[k * kEveryPair];
    progress.update("the stripe by both eyes", static_cast<double>(done++) / static_cast<double>(all.size()));
    const auto other = std::find_if(in_right.begin(), in_right.end(), [&](const FrameRecord* candidate) {
      return std::chrono::abs(candidate->stamp - frame.stamp) < kSameMoment;
    });
    const auto q = joints.interpolate(frame.stamp - late);
    if (other == in_right.end() || !q.ok()) return;
    const auto line = [](const StripeDetection& seen) {
      StripeLine out{seen.orientation == StripeOrientation::kRows, {}};
      for (const StripePeak& peak : seen.peaks)
        out.points.push_back({static_cast<int>(std::lround(peak.column)), peak.position, peak.sigma_px});
      return out;
    };
    const StripeLine a = line(detect_stripe(session.image(frame), left_dark, {})),
                     b = line(detect_stripe(session.image(**other), right_dark, {}));
    if (a.rows != b.rows) return;
    all[k] = {frame.index, frame.pass, q.value().q, points_by_stereo(left.model, right.model, cMr, a, b)};
  });
  std::erase_if(all, [](const SheetView& view) { return view.points.size() < kLeastOnSheet; });
  return all;
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
