#include "apps/tankrig/calibrate_all/held_back_checks.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <map>

#include "calibration/laser_plane/stripe_stretches.hpp"
#include "core/input_error.hpp"
#include "core/ray_meeting.hpp"

namespace tankrig::app {
namespace {

// Up to these a scan of the paper's box stays within 1.5 mm by laser and 2.5 mm by stereo.
constexpr double kLensLimit_px = 0.4, kMarkerLimit_px = 1.0, kStereoLimit_mm = 1.0, kSheetLimit_mm = 1.0;
constexpr double kMountLimit_px = 1.0;
constexpr double kOutOfView_px = 1e4;
constexpr std::size_t kLeastCorners = 6;  // of a board, in both pictures

class RootMeanSquare {
 public:
  void add(double value) { squares_ += value * value, ++count_; }
  void add(const RootMeanSquare& others) { squares_ += others.squares_, count_ += others.count_; }
  /// Infinite of nothing.
  double value() const { return count_ ? std::sqrt(squares_ / static_cast<double>(count_)) : HUGE_VAL; }

 private:
  double squares_ = 0;
  std::size_t count_ = 0;
};

/// Errors: InputError if there was nothing to judge by.
CalibrationCheck check(const std::string& name, const RootMeanSquare& error, double limit, const char* unit) {
  if (!std::isfinite(error.value())) throw InputError(name + ": nothing of it was seen, expected some to judge by");
  return {name, error.value(), limit, unit};
}

struct SharedCorner {
  Vector3d t;  ///< on the board
  Vector2d left, right;
};

/// The least error over the ways in which the right picture's board may be read: it may look the same when turned. Of nothing where the
/// pictures share too few corners.
template <typename ErrorOf>
RootMeanSquare least_over_turns(const BoardTarget& target, const BoardPair& pair, const ErrorOf& error_of) {
  const std::vector<Vector3d> points = target.points();
  RootMeanSquare least;
  for (const std::vector<int>& turn : target.turns()) {
    std::map<int, Vector2d> right;
    for (std::size_t i = 0; i < pair.right.ids.size(); ++i)
      right[turn[static_cast<std::size_t>(pair.right.ids[i])]] = pair.right.pixels[i];
    std::vector<SharedCorner> corners;
    for (std::size_t i = 0; i < pair.left.ids.size(); ++i)
      if (const auto other = right.find(pair.left.ids[i]); other != right.end())
        corners.push_back({points[static_cast<std::size_t>(other->first)], pair.left.pixels[i], other->second});
    if (corners.size() < kLeastCorners) continue;
    const RootMeanSquare error = error_of(corners);
    if (error.value() < least.value()) least = error;
  }
  return least;
}

}  // namespace

CalibrationCheck lens_check(const RigCamera& camera, const BoardTarget& target,
                            const std::vector<BoardPicture>& pictures) {
  RootMeanSquare error;
  const std::vector<Vector3d> points = target.points();
  for (const BoardPicture& picture : pictures) {
    SeenMarker seen;
    for (std::size_t k = 0; k < picture.board.ids.size(); ++k)
      seen.points.push_back(points[static_cast<std::size_t>(picture.board.ids[k])]);
    seen.corners = picture.board.pixels;
    const auto pose = seen.points.size() < 4 ? std::nullopt : planar_pose(camera.model, seen);
    if (pose) error.add(pose->rms_px);
  }
  return check(camera.name + ": corners of boards", error, kLensLimit_px, "px");
}

CalibrationCheck stereo_check(const RigCamera& left, const RigCamera& right, const BoardTarget& target,
                              const std::vector<BoardPair>& pairs) {
  RootMeanSquare error;
  const Transform cMr = left.bMc.inverse() * right.bMc;
  for (const BoardPair& pair : pairs)
    error.add(least_over_turns(target, pair, [&](const std::vector<SharedCorner>& corners) {
      const auto n = static_cast<Eigen::Index>(corners.size());
      Eigen::Matrix3Xd board(3, n), placed(3, n);
      for (Eigen::Index k = 0; k < n; ++k) {
        const SharedCorner& corner = corners[static_cast<std::size_t>(k)];
        board.col(k) = corner.t;
        placed.col(k) = meeting(left.model.sight(corner.left.x(), corner.left.y()),
                                cMr * right.model.sight(corner.right.x(), corner.right.y()));
      }
      const Eigen::Matrix4d fit = Eigen::umeyama(board, placed, false);
      RootMeanSquare off;
      for (Eigen::Index k = 0; k < n; ++k)
        off.add(1e3 * (fit.topLeftCorner<3, 3>() * board.col(k) + fit.topRightCorner<3, 1>() - placed.col(k)).norm());
      return off;
    }));
  return check("stereo: corners of boards", error, kStereoLimit_mm, "mm");
}

CalibrationCheck mount_check(const RigCamera& from, const RigCamera& camera, const BoardTarget& target,
                             const std::vector<BoardPair>& pairs) {
  RootMeanSquare error;
  const Transform rMc = camera.bMc.inverse() * from.bMc;
  for (const BoardPair& pair : pairs)
    error.add(least_over_turns(target, pair, [&](const std::vector<SharedCorner>& corners) {
      SeenMarker seen;
      for (const SharedCorner& corner : corners) seen.points.push_back(corner.t), seen.corners.push_back(corner.left);
      RootMeanSquare off;
      const auto board = planar_pose(from.model, seen);
      if (!board) return off;
      for (const SharedCorner& corner : corners) {
        const auto pixel = camera.model.project(rMc * board->cMg * corner.t);
        off.add(pixel ? (*pixel - corner.right).norm() : kOutOfView_px);
      }
      return off;
    }));
  return check(camera.name + ": boards that " + from.name + " places", error, kMountLimit_px, "px");
}

CalibrationCheck marker_check(const RigCamera& camera, const ArmModel& arm, const Transform& eMg,
                              const std::vector<HandEyeView>& views) {
  RootMeanSquare error;
  const Transform cMb = camera.bMc.inverse();
  for (const HandEyeView& view : views)
    for (std::size_t k = 0; k < view.points.size(); ++k) {
      const auto pixel = camera.model.project(cMb * arm.bMe(*view.q) * eMg * view.points[k]);
      error.add(pixel ? (*pixel - view.corners[k]).norm() : kOutOfView_px);
    }
  return check(camera.name + ": marker in the gripper", error, kMarkerLimit_px, "px");
}

CalibrationCheck sheet_check(const RigCamera& camera, const ArmModel& arm, const Plane& ePl,
                             const std::vector<SheetViews>& boards) {
  std::vector<double> off;
  for (const SheetViews& board : boards)
    for (const SheetView& view : board.views) {
      const Plane cPl = camera.bMc.inverse() * arm.bMe(view.q) * ePl;
      const std::vector<double> of_view = stretches_off(camera.model, cPl, board.board.cMt, view.points);
      off.insert(off.end(), of_view.begin(), of_view.end());
    }
  RootMeanSquare error;
  if (const auto rms = rms_of_stretches(off)) error.add(1e3 * *rms);
  return check("laser: stripe on boards", error, kSheetLimit_mm, "mm");
}

}  // namespace tankrig::app
