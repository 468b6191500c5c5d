#include "apps/tankrig/calibrate/laser_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "calibration/laser_plane/stripe_points.hpp"
#include "core/input_error.hpp"
#include "core/regular_file.hpp"
#include "reconstruction/stripe/stripe_detector.hpp"
#include "session/reading/picture_file.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

constexpr std::size_t kLeastOnBoard = 12;  // stripe points of one picture
constexpr double kLeastSigma = 1e-5;       // [m]
constexpr double kWorstBoard = 1.5;        // reprojection of one picture's corners [px]

StripeLine line_of(const std::vector<StripePeak>& peaks, StripeOrientation orientation) {
  StripeLine line{orientation == StripeOrientation::kRows, {}};
  for (const StripePeak& peak : peaks)
    line.points.push_back({static_cast<int>(std::lround(peak.column)), peak.position, peak.sigma_px});
  return line;
}

/// Where the effect is computed: on the points themselves, along the rays that saw them.
std::vector<TargetView> some_targets(const LaserPlaneProblem& problem, const std::vector<Vector3d>& eyes) {
  std::vector<TargetView> targets;
  const std::size_t step = std::max<std::size_t>(1, problem.points.size() / 200);
  for (std::size_t i = 0; i < problem.points.size(); i += step) {
    const Vector3d& p = problem.points[i].p;
    targets.push_back({p, (p - eyes[static_cast<std::size_t>(problem.points[i].group)]).normalized()});
  }
  return targets;
}

}  // namespace

LaserData laser_data_of_pictures(const std::vector<fs::path>& files, const CameraModel& camera,
                                 const Checkerboard& board, Progress& progress) {
  LaserData data;
  double squares = 0;
  const auto leave_out = [&](const fs::path& file, const std::string& why) {
    data.left_out.push_back(file.filename().string() + ": " + why);
  };
  for (std::size_t i = 0; i < files.size(); ++i) {
    const fs::path& file = files[i];
    progress.update("looking for board and stripe", static_cast<double>(i) / static_cast<double>(files.size()));
    const ExpectedSize size{camera.width, camera.height, "as the camera file says"};
    const cv::Mat picture = decode_picture(read_regular_file(file, kMostPictureBytes, "a picture"), file, &size,
                                           cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
    const auto seen = find_checkerboard(picture, board, camera);
    if (!seen) {
      leave_out(file, "not all corners of the board are seen");
      continue;
    }
    if (seen->rms > kWorstBoard) {
      leave_out(file, fmt::format("the board's corners are {:.1f} px from the camera's view of it, at most {} expected",
                                  seen->rms, kWorstBoard));
      continue;
    }
    const StripeDetection stripe = detect_stripe(picture, {}, {});
    const auto points = points_on_board(camera, line_of(stripe.peaks, stripe.orientation), seen->cMt, area_of(board));
    if (points.size() < kLeastOnBoard) {
      leave_out(file, fmt::format("{} stripe points on the board, at least {} expected", points.size(), kLeastOnBoard));
      continue;
    }
    squares += seen->rms * seen->rms;
    const int group = static_cast<int>(data.problem.groups.size());
    data.problem.groups.push_back({file.filename().string(), {}});
    for (const PlacedStripePoint& point : points)
      data.problem.points.push_back({point.p, std::max(point.sigma, kLeastSigma), group});
  }
  if (data.problem.groups.empty())
    throw InputError(fmt::format("calibrate laser: found board and stripe in none of {} pictures{}", files.size(),
                                 data.left_out.empty() ? "" : ": " + data.left_out.front()));
  data.board_rms = std::sqrt(squares / static_cast<double>(data.problem.groups.size()));
  data.problem.targets =
      some_targets(data.problem, std::vector<Vector3d>(data.problem.groups.size(), Vector3d::Zero()));
  progress.finish_line();
  return data;
}

}  // namespace tankrig::app
