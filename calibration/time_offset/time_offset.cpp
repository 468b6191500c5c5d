#include "calibration/time_offset/time_offset.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "calibration/time_offset/stripe_pairs.hpp"
#include "core/input_error.hpp"
#include "core/median.hpp"

namespace tankrig {
namespace {

constexpr double kLeastSine = 0.02;  // of the angle between ray and laser plane
constexpr std::size_t kLeastPairs = 200;
constexpr double kLeastFrames = 21;  // of a pass that see places of the other
constexpr int kLeastWaves = 2;
constexpr double kWaves = 0.2;       // times frames^(2/3); see of_waves
constexpr std::size_t kReach = 8;    // frames of both passes; see of_frames
constexpr double kSpeedRatio = 1.2;  // of recordings from which the backlash is estimated
constexpr double kOutlier = 4;       // robust standard deviations beyond which a pair does not count
constexpr double kTimeStep = 2e-2;   // [s] of the derivatives: joint samples nearer to each other err by ticks
constexpr double kPlayStep = 1e-4;   // [rad]
constexpr int kIterations = 20;

using Parameters = Eigen::Vector2d;  // offset [s], backlash [rad]

/// One recording with its pairs, and what does not change while the offset is looked for.
struct Sweeps {
  const TimeOffsetRecording* recording = nullptr;
  std::vector<StripePair> pairs;
  std::vector<int> direction;  ///< of every stripe: the sign of the swept joint's velocity; 0: takes no part
  int joint = 0;
  double speed = 0;
};

bool covered(const TimeOffsetRecording& recording, std::size_t stripe) {
  const Stamp when = recording.stripes[stripe].stamp;
  return when - from_seconds(kMotionReach) >= recording.joints.front().stamp &&
         when + from_seconds(kMotionReach) <= recording.joints.back().stamp;
}

Sweeps prepare(const TimeOffsetProblem& problem, const TimeOffsetRecording& recording) {
  if (recording.joints.size() < 2)
    throw InputError(
        fmt::format("time offset: found {} joint samples, expected those of the whole sweep", recording.joints.size()));
  const std::vector<PassMotion> motions = pass_motions(recording);
  const auto moves = [&](double side) {
    return std::any_of(motions.begin(), motions.end(), [&](const PassMotion& m) { return m.velocity * side > 0; });
  };
  if (!moves(1) || !moves(-1))
    throw InputError(fmt::format(
        "time offset: found {} {} of the sweep, all in one direction, expected one there and one back: scan with "
        "passes: 2 and there_and_back: true",
        motions.size(), motions.size() == 1 ? "pass" : "passes"));
  Sweeps sweeps;
  sweeps.recording = &recording;
  sweeps.joint = motions.front().joint;
  std::map<int, int> direction;
  for (const PassMotion& m : motions) {
    direction[m.pass] = m.velocity > 0 ? 1 : -1;
    sweeps.speed += std::abs(m.velocity) / static_cast<double>(motions.size());
  }
  for (const TimedStripe& s : recording.stripes) sweeps.direction.push_back(direction[s.pass]);
  sweeps.pairs = stripe_pairs(recording, problem.camera, problem.rows);
  std::erase_if(sweeps.pairs, [&](const StripePair& p) {
    return !covered(recording, p.single) || !covered(recording, p.before) || !covered(recording, p.after);
  });
  return sweeps;
}

std::vector<Plane> planes(const TimeOffsetProblem& problem, const Sweeps& sweeps, const Parameters& p) {
  std::vector<Plane> out(sweeps.recording->stripes.size());
  for (std::size_t s = 0; s < out.size(); ++s) {
    JointVector q = motion_at(sweeps.recording->joints, sweeps.recording->stripes[s].stamp - from_seconds(p[0])).q;
    q[sweeps.joint] -= 0.5 * p[1] * sweeps.direction[s];
    out[s] = (problem.cMb * problem.arm.bMe(q)) * problem.ePl;
  }
  return out;
}

double inverse_depth(const Plane& plane, const Vector3d& x) { return -plane.normal.dot(x) / plane.offset; }

/// Backward less forward range on the pair's ray [m]; not a number where the geometry is impossible.
double distance(const StripePair& pair, const std::vector<Plane>& planes) {
  const double single = inverse_depth(planes[pair.single], pair.x);
  const double other = (1 - pair.weight) * inverse_depth(planes[pair.before], pair.x_before) +
                       pair.weight * inverse_depth(planes[pair.after], pair.x_after);
  if (!(single > 0) || !(other > 0)) return std::nan("");
  return pair.backward * (1 / single - 1 / other) * pair.x.norm();
}

/// The pairs' distances as a function of the parameters.
class Residuals {
 public:
  explicit Residuals(const TimeOffsetProblem& problem) : problem_(problem) {
    for (const TimeOffsetRecording& r : problem.recordings) sweeps_.push_back(prepare(problem, r));
    const Parameters zero = Parameters::Zero();
    for (Sweeps& s : sweeps_) {
      const std::vector<Plane> at_zero = planes(problem, s, zero);
      std::erase_if(s.pairs, [&](const StripePair& p) {
        const Plane& plane = at_zero[p.single];
        return std::abs(plane.normal.dot(p.x.normalized())) < kLeastSine || std::isnan(distance(p, at_zero));
      });
      pairs_ += s.pairs.size();
    }
  }

  Eigen::VectorXd at(const Parameters& p) const {
    Eigen::VectorXd out(static_cast<Eigen::Index>(pairs_));
    Eigen::Index i = 0;
    for (const Sweeps& s : sweeps_) {
      const std::vector<Plane> now = planes(problem_, s, p);
      for (const StripePair& pair : s.pairs) out[i++] = distance(pair, now);
    }
    return out;
  }

  std::size_t pairs() const { return pairs_; }
  const std::vector<Sweeps>& sweeps() const { return sweeps_; }

  std::size_t stripes() const {
    std::size_t count = 0;
    for (const Sweeps& s : sweeps_) {
      std::vector<bool> used(s.recording->stripes.size());
      for (const StripePair& p : s.pairs) used[p.single] = used[p.before] = used[p.after] = true;
      count += static_cast<std::size_t>(std::count(used.begin(), used.end(), true));
    }
    return count;
  }

 private:
  const TimeOffsetProblem& problem_;
  std::vector<Sweeps> sweeps_;
  std::size_t pairs_ = 0;
};

double median_of(std::vector<double> values) { return values.empty() ? 0 : upper_median(values); }

CloudDistance distance_of(const Eigen::VectorXd& r) {
  std::vector<double> absolute;
  for (const double x : r) absolute.push_back(std::abs(x));
  CloudDistance d;
  d.mean = r.mean();
  d.median = median_of(absolute);
  std::sort(absolute.begin(), absolute.end());
  absolute.resize(std::max<std::size_t>(1, absolute.size() * 95 / 100));
  double squares = 0;
  for (const double x : absolute) squares += x * x;
  d.rms = std::sqrt(squares / static_cast<double>(absolute.size()));
  return d;
}

/// The residuals made linear at one point; pairs of different things, a reflection say, have no weight.
struct Linear {
  Eigen::VectorXd r;
  Eigen::Matrix<double, Eigen::Dynamic, 2> jacobian;
  Eigen::VectorXd weight;
};

Linear linearise(const Residuals& residuals, const Parameters& p) {
  Linear l;
  l.r = residuals.at(p);
  l.jacobian.resize(l.r.size(), 2);
  const Parameters step{kTimeStep, kPlayStep};
  for (int k = 0; k < 2; ++k) {
    const Parameters h = step[k] * Parameters::Unit(k);
    l.jacobian.col(k) = (residuals.at(p + h) - residuals.at(p - h)) / (2 * step[k]);
  }
  Eigen::VectorXd sigma(l.r.size());
  Eigen::Index i = 0;
  for (const Sweeps& s : residuals.sweeps())
    for (const StripePair& pair : s.pairs)
      sigma[i] = std::max(pair.sigma_s * std::abs(l.jacobian(i, 0)) / 2, 1e-7), ++i;
  std::vector<double> normalised;
  for (i = 0; i < l.r.size(); ++i) normalised.push_back(std::abs(l.r[i] / sigma[i]));
  const double scale = std::max(1.4826 * median_of(normalised), 1e-9);
  l.weight.resize(l.r.size());
  for (i = 0; i < l.r.size(); ++i) {
    const double u = std::abs(l.r[i] / sigma[i]) / scale;
    l.weight[i] = (u <= kOutlier ? 1 : 0) / (sigma[i] * sigma[i]);
    if (!std::isfinite(l.r[i]) || !l.jacobian.row(i).allFinite())
      l.weight[i] = 0, l.r[i] = 0, l.jacobian.row(i).setZero();
  }
  return l;
}

/// Normal equations of `free` parameters over some pairs.
struct Normal {
  Eigen::Matrix2d h = Eigen::Matrix2d::Zero();
  Eigen::Vector2d g = Eigen::Vector2d::Zero();

  void add(const Linear& l, Eigen::Index i) {
    const Eigen::Vector2d j = l.jacobian.row(i);
    h += l.weight[i] * j * j.transpose();
    g -= l.weight[i] * j * l.r[i];
  }
  Parameters step(bool with_backlash) const {
    if (with_backlash) return h.ldlt().solve(g);
    return {g[0] / h(0, 0), 0};
  }
};

/// Of one recording: how many frames of a pass see places of another, on average.
double frames_in_a_pass(const Sweeps& s) {
  std::map<int, std::set<std::size_t>> frames;
  for (const StripePair& p : s.pairs) frames[s.recording->stripes[p.single].pass].insert(p.single);
  double count = 0;
  for (const auto& [pass, singles] : frames) count += static_cast<double>(singles.size());
  return count / static_cast<double>(std::max<std::size_t>(frames.size(), 1));
}

/// Variance of the score, the sum over all places, or of the solution.
struct Variance {
  Eigen::Matrix2d matrix = Eigen::Matrix2d::Zero();
  double freedom = 1;

  /// Half a 95 % interval of the first parameter.
  double width() const { return quantile(boost::math::students_t(freedom), 0.975) * std::sqrt(matrix(0, 0)); }
};

/// A pair's part of the score, and of the information about the offset.
struct Place {
  double angle;  ///< of the joint
  std::size_t frame;
  Eigen::Vector2d score;
  double information;
};

/// Joints in whole ticks err alike for many frames: the slowest waves of the error along the sweep (Lazarus, Lewis,
/// Stock and Watson 2018: equal-weighted cosines). Their rule has 0.4 frames^(2/3) waves; whole ticks err alike for
/// longer than their examples, so here are fewer.
Variance of_waves(const std::vector<Place>& places, double frames) {
  const int waves = std::max(kLeastWaves, static_cast<int>(kWaves * std::pow(frames, 2.0 / 3)));
  double total = 0, before = 0;
  for (const Place& p : places) total += p.information;
  Eigen::Matrix2Xd sums = Eigen::Matrix2Xd::Zero(2, waves);
  for (const Place& p : places) {
    const double way = (before + 0.5 * p.information) / total;
    before += p.information;
    for (int k = 0; k < waves; ++k)
      sums.col(k) += std::numbers::sqrt2 * std::cos(std::numbers::pi * (k + 1) * way) * p.score;
  }
  return {sums * sums.transpose() / waves, static_cast<double>(waves)};
}

/// A frame errs alike in all of its lines, and neighbours of both passes share frames: their products, fewer the
/// farther apart (Newey and West 1987). Two waves are small by chance now and then; these are not, but what errs alike
/// for longer than their reach is not in them.
Variance of_frames(const std::vector<Place>& places) {
  std::vector<std::pair<std::size_t, Eigen::Vector2d>> frames;
  for (const Place& p : places) {
    const bool another = frames.empty() || frames.back().first != p.frame;
    if (another) frames.emplace_back(p.frame, Eigen::Vector2d::Zero());
    frames.back().second += p.score;
  }
  Variance out;
  for (std::size_t i = 0; i < frames.size(); ++i)
    for (std::size_t lag = 0; lag < kReach && i + lag < frames.size(); ++lag) {
      const Eigen::Matrix2d product = frames[i].second * frames[i + lag].second.transpose();
      const double share = 1 - static_cast<double>(lag) / kReach;
      out.matrix += lag == 0 ? product : Eigen::Matrix2d(share * (product + product.transpose()));
    }
  out.freedom = 1.5 * static_cast<double>(frames.size()) / kReach;
  return out;
}

/// Each recording for itself, by the wider of the two.
Variance variance_of(const std::vector<Sweeps>& recordings, Duration offset, const Linear& l, const Normal& all,
                     bool with_backlash) {
  Eigen::Matrix2d inverse = Eigen::Matrix2d::Zero();
  inverse(0, 0) = 1 / all.h(0, 0);
  if (with_backlash) inverse = all.h.inverse();
  Variance out;
  double squares = 0;
  Eigen::Index i = 0;
  for (const Sweeps& s : recordings) {
    const double frames = frames_in_a_pass(s);
    if (frames < kLeastFrames)
      throw InputError(fmt::format(
          "time offset: the stripe is seen in both directions in {} frames of a pass, expected at least {}: a longer "
          "or slower sweep",
          static_cast<int>(frames), kLeastFrames));
    double total = 0;
    std::vector<Place> places;
    for (const StripePair& p : s.pairs) {
      places.push_back({motion_at(s.recording->joints, s.recording->stripes[p.single].stamp - offset).q[s.joint],
                        p.single, l.weight[i] * l.r[i] * l.jacobian.row(i),
                        l.weight[i] * l.jacobian(i, 0) * l.jacobian(i, 0)});
      total += places.back().information;
      ++i;
    }
    if (!(total > 0)) throw InputError("time offset: no place of a recording agrees in both directions");
    std::stable_sort(places.begin(), places.end(), [](const Place& a, const Place& b) { return a.angle < b.angle; });
    const auto of_solution = [&](const Variance& v) { return Variance{inverse * v.matrix * inverse, v.freedom}; };
    const Variance waves = of_solution(of_waves(places, frames)), frame = of_solution(of_frames(places));
    const Variance& wider = frame.width() > waves.width() ? frame : waves;
    out.matrix += wider.matrix;
    squares += wider.matrix(0, 0) * wider.matrix(0, 0) / wider.freedom;
  }
  out.freedom = out.matrix(0, 0) * out.matrix(0, 0) / squares;
  return out;
}

}  // namespace

TimeOffsetSolution solve(const TimeOffsetProblem& problem) {
  if (problem.recordings.empty()) throw InputError("time offset: found no recording, expected a sweep there and back");
  const Residuals residuals(problem);
  if (residuals.pairs() < kLeastPairs)
    throw InputError(fmt::format(
        "time offset: found {} places on the target that the stripe passed in both directions, expected at least {}: "
        "is the laser seen in both passes?",
        residuals.pairs(), kLeastPairs));
  TimeOffsetSolution out;
  double slowest = 1e9, fastest = 0;
  for (const Sweeps& s : residuals.sweeps()) {
    out.speeds.push_back(s.speed);
    slowest = std::min(slowest, s.speed);
    fastest = std::max(fastest, s.speed);
  }
  const bool with_backlash = fastest > kSpeedRatio * slowest;

  Parameters p = Parameters::Zero();
  Linear linear = linearise(residuals, p);
  out.before = distance_of(linear.r);
  for (int i = 0; i < kIterations; ++i) {
    Normal normal;
    for (Eigen::Index k = 0; k < linear.r.size(); ++k) normal.add(linear, k);
    if (!(normal.h(0, 0) > 0)) throw InputError("time offset: the stripe does not move between frames");
    const Parameters step = normal.step(with_backlash);
    p += step;
    linear = linearise(residuals, p);
    if (std::abs(step[0]) < 1e-8) break;
  }

  Normal normal;
  std::vector<double> speeds;
  for (Eigen::Index k = 0; k < linear.r.size(); ++k) {
    normal.add(linear, k);
    speeds.push_back(std::abs(linear.jacobian(k, 0)) / 2);
  }
  const Variance variance = variance_of(residuals.sweeps(), from_seconds(p[0]), linear, normal, with_backlash);
  out.offset = p[0];
  out.sigma = std::sqrt(variance.matrix(0, 0));
  out.half_width = variance.width();
  if (with_backlash) out.backlash = p[1], out.backlash_sigma = std::sqrt(variance.matrix(1, 1));
  out.offset_per_backlash = normal.h(0, 1) / normal.h(0, 0);
  out.speed_on_target = median_of(speeds);
  out.effect = out.speed_on_target * std::abs(out.offset);
  out.effect_sigma = out.speed_on_target * out.sigma;
  out.after = distance_of(linear.r);
  out.residuals.assign(linear.r.begin(), linear.r.end());
  out.pairs = residuals.pairs();
  out.stripes = residuals.stripes();
  return out;
}

}  // namespace tankrig
