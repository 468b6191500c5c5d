#include "calibration/time_offset/stripe_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/median.hpp"

namespace tankrig {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kWidestStep = 3;        // times the typical step between frames: beyond it the stripe jumped
constexpr double kLeastStep = 0.05;      // [px] between frames: below it the crossing's time is not known
constexpr std::size_t kLeastLines = 16;  // that say where a frame lies between two others

const TimedJoints& nearest(const std::vector<TimedJoints>& joints, Stamp when) {
  const auto after =
      std::lower_bound(joints.begin(), joints.end(), when, [](const TimedJoints& j, Stamp t) { return j.stamp < t; });
  if (after == joints.begin()) return *after;
  if (after == joints.end()) return joints.back();
  return after->stamp - when < when - std::prev(after)->stamp ? *after : *std::prev(after);
}

struct Sample {
  double position = kNone, sigma = 0;
};

/// The stripe's positions of one pass: a row per frame, a cell per image line.
class PassImage {
 public:
  PassImage(const TimeOffsetRecording& recording, int pass, int lines) : lines_(static_cast<std::size_t>(lines)) {
    for (std::size_t s = 0; s < recording.stripes.size(); ++s) {
      if (recording.stripes[s].pass != pass) continue;
      frames_.push_back(s);
      samples_.resize(samples_.size() + lines_);
      Sample* row = samples_.data() + samples_.size() - lines_;
      for (const TimedStripePoint& p : recording.stripes[s].points)
        if (p.line >= 0 && p.line < lines && p.sigma > 0) row[p.line] = {p.position, p.sigma};
    }
    typical_step_ = typical_step();
  }

  std::size_t frames() const { return frames_.size(); }
  std::size_t stripe(std::size_t frame) const { return frames_[frame]; }
  const Sample& at(std::size_t frame, int line) const {
    return samples_[frame * lines_ + static_cast<std::size_t>(line)];
  }
  double widest_step() const { return kWidestStep * typical_step_; }

 private:
  double typical_step() const {
    std::vector<double> steps;
    for (std::size_t f = 1; f < frames_.size(); ++f)
      for (std::size_t line = 0; line < lines_; line += 4) {
        const double step = std::abs(samples_[f * lines_ + line].position - samples_[(f - 1) * lines_ + line].position);
        if (std::isfinite(step)) steps.push_back(step);
      }
    return steps.empty() ? 0 : upper_median(steps);
  }

  std::size_t lines_;
  std::vector<std::size_t> frames_;
  std::vector<Sample> samples_;
  double typical_step_ = 0;
};

/// Two neighbouring frames of a pass, between which the stripe went over its place in a frame of another pass.
struct Bracket {
  std::size_t second = 0;  ///< index of the later frame; 0: there is none
  double weight = 0;       ///< of the later frame
  double step = 0;         ///< of the stripe between the two [px]
};

/// All lines together say where: one line's own fraction of the way would err with its noise, always to the same side.
Bracket bracket_of(const PassImage& singles, std::size_t single, const PassImage& pass, int lines) {
  const auto visit = [&](std::size_t second, auto use) {
    for (int line = 0; line < lines; ++line) {
      const double s = singles.at(single, line).position;
      const double a = pass.at(second - 1, line).position, b = pass.at(second, line).position;
      const double step = std::abs(b - a);
      if (std::isfinite(s) && step >= kLeastStep && step <= pass.widest_step()) use(s, a, b);
    }
  };
  Bracket out;
  int most = 0;
  for (std::size_t f = 1; f < pass.frames(); ++f) {
    int between = 0;
    visit(f, [&](double s, double a, double b) { between += (a <= s && s < b) || (b < s && s <= a); });
    if (between > most) most = between, out.second = f;
  }
  if (out.second == 0) return out;
  std::vector<double> weights, steps;
  visit(out.second, [&](double s, double a, double b) {
    weights.push_back((s - a) / (b - a));
    steps.push_back(std::abs(b - a));
  });
  if (weights.size() < kLeastLines) return {};
  out.weight = upper_median(weights);
  out.step = upper_median(steps);
  return out;
}

Vector3d ray_of(const CameraModel& camera, bool rows, int line, double position) {
  // Behind a port: what both directions of a sweep are off by at other depths, they have in common.
  constexpr double kTypicalDepth = 1;  // [m]
  return (rows ? camera.normalized(position, line, kTypicalDepth) : camera.normalized(line, position, kTypicalDepth))
      .homogeneous();
}

void add_pairs(const TimeOffsetRecording& recording, const CameraModel& camera, bool rows, const PassImage& singles,
               const PassImage& brackets, int backward, std::vector<StripePair>& pairs) {
  const int lines = rows ? camera.height : camera.width;
  for (std::size_t f = 0; f < singles.frames(); ++f) {
    const Bracket bracket = bracket_of(singles, f, brackets, lines);
    if (bracket.second == 0) continue;
    StripePair pair;
    pair.single = singles.stripe(f);
    pair.before = brackets.stripe(bracket.second - 1);
    pair.after = brackets.stripe(bracket.second);
    pair.weight = bracket.weight;
    pair.backward = backward;
    const double speed =
        bracket.step / seconds(recording.stripes[pair.after].stamp - recording.stripes[pair.before].stamp);
    for (int line = 0; line < lines; ++line) {
      const Sample& single = singles.at(f, line);
      const Sample &a = brackets.at(bracket.second - 1, line), &b = brackets.at(bracket.second, line);
      const double there = (1 - pair.weight) * a.position + pair.weight * b.position;
      if (!(std::abs(b.position - a.position) <= brackets.widest_step()) ||
          !(std::abs(single.position - there) <= bracket.step))
        continue;
      pair.x = ray_of(camera, rows, line, single.position);
      pair.x_before = ray_of(camera, rows, line, a.position);
      pair.x_after = ray_of(camera, rows, line, b.position);
      pair.sigma_s = std::hypot(single.sigma, (1 - pair.weight) * a.sigma, pair.weight * b.sigma) / speed;
      pairs.push_back(pair);
    }
  }
}

}  // namespace

std::vector<PassMotion> pass_motions(const TimeOffsetRecording& recording) {
  std::map<int, std::pair<const TimedStripe*, const TimedStripe*>> ends;
  for (const TimedStripe& s : recording.stripes) {
    auto& [first, last] = ends.try_emplace(s.pass, &s, &s).first->second;
    last = &s;
  }
  std::vector<PassMotion> motions;
  for (const auto& [pass, span] : ends) {
    if (recording.joints.empty()) break;
    const TimedJoints &a = nearest(recording.joints, span.first->stamp),
                      &b = nearest(recording.joints, span.second->stamp);
    if (!(b.stamp > a.stamp)) continue;
    PassMotion motion{pass, 0, 0};
    const JointVector way = b.q - a.q;
    way.cwiseAbs().maxCoeff(&motion.joint);
    motion.velocity = way[motion.joint] / seconds(b.stamp - a.stamp);
    motions.push_back(motion);
  }
  return motions;
}

std::vector<StripePair> stripe_pairs(const TimeOffsetRecording& recording, const CameraModel& camera, bool rows) {
  const std::vector<PassMotion> motions = pass_motions(recording);
  std::vector<PassImage> images;
  for (const PassMotion& m : motions) images.emplace_back(recording, m.pass, rows ? camera.height : camera.width);
  std::vector<StripePair> pairs;
  // Both ways round: each pass once gives the points and once the frames they are held against.
  for (std::size_t a = 0; a < motions.size(); ++a)
    for (std::size_t b = 0; b < motions.size(); ++b)
      if (motions[a].joint == motions[b].joint && motions[a].velocity * motions[b].velocity < 0)
        add_pairs(recording, camera, rows, images[a], images[b], motions[a].velocity < 0 ? 1 : -1, pairs);
  return pairs;
}

}  // namespace tankrig
