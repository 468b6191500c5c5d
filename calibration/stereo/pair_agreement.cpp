#include "calibration/stereo/pair_agreement.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "core/angles.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"

namespace tankrig {
namespace {

constexpr double kMostAngle = 3 * 3.14159265358979323846 / 180;  // between the poses that two pairs give
constexpr double kMostShift = 0.06;                              // of the target's distance
constexpr double kMostAstray = 1 / 3.0;

/// What a pair says of rMc, for each way its right target may be read.
struct Saying {
  std::vector<Transform> rMc;
  double distance = 0;
};

bool alike(const Transform& a, const Transform& b, double distance) {
  const Transform between = a.inverse() * b;
  return Eigen::AngleAxisd(between.rotation()).angle() < kMostAngle &&
         between.translation().norm() < kMostShift * distance;
}

/// The right board with each corner's number as it is when the target is turned.
FoundBoard turned(const FoundBoard& board, const std::vector<int>& turn) {
  std::vector<std::pair<int, Vector2d>> corners;
  for (std::size_t i = 0; i < board.ids.size(); ++i)
    corners.emplace_back(turn[static_cast<std::size_t>(board.ids[i])], board.pixels[i]);
  std::sort(corners.begin(), corners.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  FoundBoard out;
  out.smallest_spacing = board.smallest_spacing;
  for (const auto& [id, pixel] : corners) out.ids.push_back(id), out.pixels.push_back(pixel);
  return out;
}

/// The right camera as it is if its pictures are mirrored, with its boards.
FoundBoard mirrored(const FoundBoard& board, const BoardTarget& target, const CameraModel& camera) {
  FoundBoard out = board;
  for (std::size_t i = 0; i < board.ids.size(); ++i) {
    out.pixels[i].x() = camera.width - 1 - board.pixels[i].x();
    // Seen from the front again: rows of a board that looks the same in a mirror change places.
    out.ids[i] = (target.rows - 1 - board.ids[i] / target.columns) * target.columns + board.ids[i] % target.columns;
  }
  return out;
}

class Agreement {
 public:
  Agreement(const CameraModel& left, const CameraModel& right, const BoardTarget& target)
      : left_(left), right_(right), target_(target), points_(target.points()), turns_(target.turns()) {}

  std::optional<Saying> saying(const FoundBoard& in_left, const FoundBoard& in_right) const {
    const auto cMt = board_pose({left_}, points_, in_left);
    if (!cMt) return std::nullopt;
    Saying saying{{}, cMt->cMt.translation().norm()};
    for (const std::vector<int>& turn : turns_)
      if (const auto rMt = board_pose({right_}, points_, turned(in_right, turn)))
        saying.rMc.push_back(rMt->cMt * cMt->cMt.inverse());
    if (saying.rMc.size() != turns_.size()) return std::nullopt;
    return saying;
  }

  /// The rMc that most sayings agree with, and how many.
  static std::pair<Transform, std::size_t> majority(const std::vector<std::optional<Saying>>& sayings) {
    std::pair<Transform, std::size_t> best{Transform::Identity(), 0};
    for (const auto& one : sayings) {
      if (!one) continue;
      for (const Transform& rMc : one->rMc) {
        const auto agreeing = static_cast<std::size_t>(std::count_if(
            sayings.begin(), sayings.end(), [&](const auto& other) { return other && agreeing_turn(*other, rMc); }));
        if (agreeing > best.second) best = {rMc, agreeing};
      }
    }
    return best;
  }
  static std::optional<std::size_t> agreeing_turn(const Saying& saying, const Transform& rMc) {
    for (std::size_t i = 0; i < saying.rMc.size(); ++i)
      if (alike(saying.rMc[i], rMc, saying.distance)) return i;
    return std::nullopt;
  }

  /// What would make the pairs agree.
  std::string remedy(const std::vector<BoardPair>& pairs) const {
    const auto enough = [&](const std::vector<std::optional<Saying>>& sayings) {
      return double(majority(sayings).second) > (1 - kMostAstray) * double(sayings.size());
    };
    for (const std::size_t shift : {std::size_t{1}, pairs.size() - 1}) {
      std::vector<std::optional<Saying>> shifted;
      for (std::size_t i = 0; i < pairs.size(); ++i)
        shifted.push_back(saying(pairs[i].left, pairs[(i + shift) % pairs.size()].right));
      if (enough(shifted))
        return fmt::format(
            ": they agree if each left picture is paired with the {} right one: pictures are out of order",
            shift == 1 ? "next" : "previous");
    }
    CameraModel flipped = right_;
    flipped.cx = right_.width - 1 - right_.cx, flipped.p2 = -right_.p2;
    const Agreement other(left_, flipped, target_);
    std::vector<std::optional<Saying>> mirrors;
    for (const BoardPair& pair : pairs)
      mirrors.push_back(other.saying(pair.left, mirrored(pair.right, target_, right_)));
    if (enough(mirrors)) return ": they agree if one camera's pictures are mirrored: set that camera right";
    return ": pictures of different moments, or out of order?";
  }

  const std::vector<std::vector<int>>& turns() const { return turns_; }

 private:
  const CameraModel &left_, &right_;
  const BoardTarget& target_;
  std::vector<Vector3d> points_;
  std::vector<std::vector<int>> turns_;
};

}  // namespace

PairAgreement agree_on_pose(const CameraModel& left, const CameraModel& right, const BoardTarget& target,
                            const std::vector<BoardPair>& pairs) {
  const Agreement agreement(left, right, target);
  std::vector<std::optional<Saying>> sayings;
  for (const BoardPair& pair : pairs) sayings.push_back(agreement.saying(pair.left, pair.right));
  PairAgreement result;
  const auto [rMc, agreeing] = Agreement::majority(sayings);
  result.rMc = rMc;
  std::string names;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto turn = sayings[i] ? Agreement::agreeing_turn(*sayings[i], rMc) : std::nullopt;
    if (!turn) {
      result.left_out.push_back(pairs[i].name);
      names += (names.empty() ? "" : ", ") + shown_text(pairs[i].name);
      continue;
    }
    result.pairs.push_back({pairs[i].name, pairs[i].left, turned(pairs[i].right, agreement.turns()[*turn])});
    if (*turn > 0) result.turned.push_back(pairs[i].name);
  }
  if (double(result.left_out.size()) > kMostAstray * double(pairs.size()))
    throw InputError(fmt::format("found {} of {} pairs that do not agree on how the cameras stand ({}){}",
                                 result.left_out.size(), pairs.size(), names, agreement.remedy(pairs)));
  return result;
}

}  // namespace tankrig
