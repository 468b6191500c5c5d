#include "apps/tankrig/calibrate_all/picture_judges.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "apps/tankrig/calibrate/dark_frames.hpp"
#include "apps/tankrig/calibrate/marker_postures.hpp"
#include "apps/tankrig/calibrate/sheet_data.hpp"
#include "apps/tankrig/calibrate/time_data.hpp"
#include "bench/report/preview_picture.hpp"
#include "calibration/laser_plane/checkerboard.hpp"
#include "reconstruction/stripe/stripe_detector.hpp"

namespace tankrig::app {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kSamePosture = 0.02;  // of the joints that turn the marker [rad]
constexpr double kElbowStep = 2 * kDegree;
constexpr std::size_t kEnoughAngles = 6;
constexpr std::size_t kMarksOnStripe = 40;

/// Its points as a board's: each with its neighbour, as they are listed.
FoundBoard as_board(const SeenMarker& seen) {
  FoundBoard board{{}, seen.corners, HUGE_VAL};
  for (std::size_t i = 1; i < seen.corners.size(); ++i)
    board.smallest_spacing = std::min(board.smallest_spacing, (seen.corners[i] - seen.corners[i - 1]).norm());
  return board;
}

class MarkerJudge {
 public:
  MarkerJudge(const GripperMarker& marker, const std::string& camera) : finder_(marker), camera_(camera) {}

  JudgedMoment judge(int posture, const RecordedPicture& picture) {
    const cv::Mat grey = grey_of(picture.image);
    const SeenMarker seen = finder_.find(grey);
    JudgedPicture judged{camera_, fmt::format("{} points", seen.points.size()), {}, 0, {}, picture.image, seen.corners};
    judged.why_not = why_not(grey, seen, picture.record.q);
    if (judged.why_not.empty()) postures_.push_back(*picture.record.q);
    judged.pictures = postures_.size();
    judged.so_far = fmt::format("{} postures", postures_.size());
    const std::string missing =
        postures_.size() < kLeastPostures
            ? fmt::format("{}, expected {}", that_count(postures_.size(), "the marker"), kLeastPostures)
            : "";
    return {"marker", posture + 1, kLeastPostures, missing, {judged}, !judged.why_not.empty()};
  }

 private:
  static constexpr std::size_t kFewestPoints = 4;  // that a pose can be told from

  std::string why_not(const cv::Mat& grey, const SeenMarker& seen, const std::optional<JointVector>& q) const {
    if (seen.points.size() < kFewestPoints) return "the marker is not found";
    if (std::string blurred = why_not_sharp(grey, as_board(seen)); !blurred.empty()) return blurred;
    if (!q) return "its joints are not known";
    const auto same = [&](const JointVector& other) { return (*q - other).head<4>().norm() < kSamePosture; };
    return std::ranges::any_of(postures_, same) ? "the arm stands as in a picture before" : "";
  }

  const MarkerFinder finder_;
  const std::string camera_;
  std::vector<JointVector> postures_;  // that count
};

class SheetJudge {
 public:
  SheetJudge(const RigCamera& camera, const TargetBoard& board)
      : camera_(camera), board_(checkerboard_of(board.pattern, board.square)) {}

  /// By whoever records.
  std::optional<int> moment_of(const FrameRecord& record) {
    if (record.camera != camera_.name) return std::nullopt;
    if (record.phase == Phase::kDarkBefore) return next_++;
    if (!lit_sweep(record)) return std::nullopt;
    const double elbow = (*record.q)[kElbow];
    if (looked_at_ && std::abs(elbow - *looked_at_) < kElbowStep) return std::nullopt;
    looked_at_ = elbow;
    return next_++;
  }

  std::optional<JudgedMoment> judge(const RecordedPicture& picture) {
    if (picture.record.phase == Phase::kDarkBefore) {
      dark_.push_back(picture.image);
      return std::nullopt;
    }
    if (!dark_.empty()) {
      background_ = median_background(dark_);
      seen_ = find_checkerboard(background_, board_, camera_.model);
      dark_.clear();
    }
    const StripeDetection stripe = detect_stripe(picture.image, background_, {});
    StripeLine line{stripe.orientation == StripeOrientation::kRows, {}};
    for (const StripePeak& peak : stripe.peaks)
      line.points.push_back({static_cast<int>(std::lround(peak.column)), peak.position, peak.sigma_px});
    const std::size_t on_board = seen_ ? points_on_board(camera_.model, line, seen_->cMt, area_of(board_)).size() : 0;
    const double clipped = cv::countNonZero(clipped_mask(picture.image)) / static_cast<double>(picture.image.total());
    const double elbow = (*picture.record.q)[kElbow];
    JudgedPicture judged{camera_.name,
                         fmt::format("{} columns of the stripe, {} on the board; {:.2f} % of the image clipped",
                                     line.points.size(), on_board, 100 * clipped),
                         why_not(line.points.size(), on_board, elbow),
                         0,
                         {},
                         picture.image,
                         {}};
    for (std::size_t i = 0; i < line.points.size(); i += line.points.size() / kMarksOnStripe + 1)
      judged.marks.push_back(line.pixel(line.points[i]));
    if (judged.why_not.empty()) elbows_.push_back(elbow);
    judged.pictures = elbows_.size();
    judged.so_far = elbows_.empty() ? "no angle of the elbow"
                                    : fmt::format("elbow {:.0f} to {:.0f} deg", std::ranges::min(elbows_) / kDegree,
                                                  std::ranges::max(elbows_) / kDegree);
    const std::string missing =
        elbows_.size() < kEnoughAngles
            ? fmt::format("{}, expected {}", that_count(elbows_.size(), "the stripe"), kEnoughAngles)
            : "";
    // The stripe reaches the board some time in the sweep, and leaves it again. A board not seen is told once.
    return JudgedMoment{"sheet", ++judged_, kEnoughAngles, missing, {judged}, !seen_ && judged_ == 1};
  }

 private:
  std::string why_not(std::size_t columns, std::size_t on_board, double elbow) const {
    if (!seen_)
      return "the checkerboard was not seen whole while the arm rested: lean it where the camera sees all of it";
    if (columns == 0) return "no stripe is found";
    if (on_board < kLeastOnSheet)
      return fmt::format("found {} columns of the stripe on the board, expected {}", on_board, kLeastOnSheet);
    const auto same = [&](double other) { return std::abs(elbow - other) < kElbowStep / 2; };
    return std::ranges::any_of(elbows_, same) ? "the elbow stands as in a picture before" : "";
  }

  const RigCamera camera_;
  const Checkerboard board_;
  std::optional<double> looked_at_;  // whoever records; as next_
  int next_ = 0;
  std::vector<cv::Mat> dark_;
  cv::Mat background_;
  std::optional<CheckerboardView> seen_;
  std::vector<double> elbows_;  // that count [rad]
  int judged_ = 0;
};

}  // namespace

PictureJudge judge_boards(BoardTarget target, BoardCount so_far, std::size_t cameras) {
  const auto moment_of = [](const FrameRecord& record) {
    return record.phase == Phase::kMove ? std::nullopt : std::optional(record.pass);
  };
  const auto judge = [=, count = std::move(so_far)](int place, const Moment& pictures) mutable {
    std::vector<BoardSearch> searches;
    for (std::size_t k = 0; k < cameras; ++k)
      searches.push_back(find_clear_board(grey_of(pictures.at(count.name(k)).image), target));
    const std::vector<std::string> why_not = count.add(searches);
    JudgedMoment moment{"board", place + 1, BoardCount::kEnough, count.missing(), {}};
    for (std::size_t k = 0; k < cameras; ++k) {
      const std::vector<Vector2d> corners = searches[k].board ? searches[k].board->pixels : std::vector<Vector2d>();
      moment.cameras.push_back({count.name(k), fmt::format("{} corners", corners.size()), why_not[k], count.pictures(k),
                                fmt::format("{:.0f} % of the image", 100 * count.covered(k)),
                                pictures.at(count.name(k)).image, corners});
    }
    moment.fault = std::ranges::none_of(why_not, &std::string::empty);
    return std::optional(moment);
  };
  return {cameras, moment_of, judge};
}

PictureJudge judge_marker(const GripperMarker& marker, const std::string& camera) {
  const auto moment_of = [camera, last = -1](const FrameRecord& record) mutable -> std::optional<int> {
    if (record.camera != camera || record.phase == Phase::kMove || record.pass == last) return std::nullopt;
    return last = record.pass;
  };
  const auto judge = std::make_shared<MarkerJudge>(marker, camera);
  return {1, moment_of, [=](int posture, const Moment& pictures) {
            return std::optional(judge->judge(posture, pictures.at(camera)));
          }};
}

PictureJudge judge_sheet(const RigCamera& camera, const TargetBoard& board) {
  const auto judge = std::make_shared<SheetJudge>(camera, board);
  return {1, [=](const FrameRecord& record) { return judge->moment_of(record); },
          [=, name = camera.name](int, const Moment& pictures) { return judge->judge(pictures.at(name)); }};
}

}  // namespace tankrig::app
