#include "apps/tankrig/calibrate_all/session_problems.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>

#include "apps/tankrig/calibrate/dark_frames.hpp"
#include "apps/tankrig/calibrate/time_data.hpp"
#include "calibration/boards/counted_pictures.hpp"
#include "reconstruction/stripe/stripe_detector.hpp"
#include "rig/sync/joint_history.hpp"

namespace tankrig::app {
namespace {

constexpr std::size_t kHeldBack = 5;
constexpr std::size_t kEveryPair = 4;
constexpr Duration kSameMoment = std::chrono::milliseconds(2), kMostJointGap = std::chrono::milliseconds(100);

}  // namespace

bool held_back(std::size_t picture) { return picture % kHeldBack == kHeldBack - 1; }

std::vector<BoardShot> board_shots(const Session& session, const std::string& camera, const BoardTarget& target,
                                   Progress& progress) {
  const auto passes = dark_frames_by_pass(session, camera);
  std::vector<BoardShot> seen(passes.size());
  std::atomic<std::size_t> done = 0;
  tbb::parallel_for(std::size_t{0}, passes.size(), [&](std::size_t k) {
    if (!passes[k].empty())
      seen[k] = {passes[k].front()->file, find_clear_board(grey_of(session.image(*passes[k].front())), target)};
    progress.update("looking for the board: " + camera,
                    static_cast<double>(++done) / static_cast<double>(passes.size()));
  });
  return seen;
}

std::vector<MarkerPosture> seen_postures(const Session& session, const std::vector<const RigCamera*>& cameras,
                                         const GripperMarker& marker, Progress& progress) {
  const MarkerFinder finder(marker);
  std::vector<std::vector<std::vector<const FrameRecord*>>> passes;
  for (const RigCamera* camera : cameras) passes.push_back(dark_frames_by_pass(session, camera->name));
  std::vector<MarkerPosture> postures;
  for (std::size_t k = 0; k < passes[0].size(); ++k) {
    progress.update("looking for the marker", static_cast<double>(k) / static_cast<double>(passes[0].size()));
    if (passes[0][k].empty() || !passes[0][k].front()->q) continue;
    MarkerPosture posture{passes[0][k].front()->file, *passes[0][k].front()->q, {}};
    for (const auto& of_camera : passes) {
      posture.seen.emplace_back();
      if (k >= of_camera.size() || of_camera[k].empty()) continue;
      SeenMarker seen = finder.find(grey_of(mean_picture(session, of_camera[k])));
      if (seen.points.size() >= 4) posture.seen.back() = std::move(seen);
    }
    if (!posture.seen[0].points.empty()) postures.push_back(std::move(posture));
  }
  return postures;
}

std::optional<HandEyeView> hand_eye_view(const MarkerPosture& posture, const CameraModel& camera) {
  const auto pose = planar_pose(camera, posture.seen[0]);
  if (!pose) return std::nullopt;
  HandEyeView view;
  view.name = posture.name;
  view.q = posture.q;
  view.points = posture.seen[0].points;
  view.corners = posture.seen[0].corners;
  view.cMg = pose->cMg;
  view.cMg_flipped = pose->flipped;
  return view;
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
    all[k] = {frame.index, frame.pass, q.value().q, q.value().velocity,
              points_by_stereo(left.model, right.model, cMr, a, b)};
  });
  std::erase_if(all, [](const SheetView& view) { return view.points.size() < kLeastOnSheet; });
  return all;
}

}  // namespace tankrig::app
