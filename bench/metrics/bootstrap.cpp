#include "bench/metrics/bootstrap.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace tankrig {
namespace {

constexpr int kDraws = 1000;
constexpr std::size_t kFewFrames = 10;
constexpr double kBlock = 0.020;  ///< [m]

/// Sums over the points of one group.
struct Group {
  double object = 0, distance = 0, distance_squared = 0, outliers = 0, not_ground = 0;

  void add(const Group& other) {
    object += other.object;
    distance += other.distance;
    distance_squared += other.distance_squared;
    outliers += other.outliers;
    not_ground += other.not_ground;
  }
};

template <class Key>
std::vector<Group> grouped(const PointCloud& cloud, const Metrics& metrics, Key key) {
  std::map<std::invoke_result_t<Key, const CloudPoint&>, Group> groups;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (!cloud.points[i].p.allFinite() || metrics.verdicts[i] == PointVerdict::kGround) continue;
    Group& group = groups[key(cloud.points[i])];
    group.not_ground += 1;
    group.outliers += metrics.verdicts[i] == PointVerdict::kOutlier;
    if (metrics.verdicts[i] != PointVerdict::kObject) continue;
    const double d = metrics.distances[i];
    group.object += 1, group.distance += d, group.distance_squared += d * d;
  }
  std::vector<Group> out;
  for (const auto& entry : groups) out.push_back(entry.second);
  return out;
}

/// SplitMix64 (G. Steele, D. Lea, C. Flood 2014).
class Draws {
 public:
  std::size_t below(std::size_t n) {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return static_cast<std::size_t>((z ^ (z >> 31)) % n);
  }

 private:
  std::uint64_t state_ = 1;
};

std::optional<Interval> interval(std::vector<double> values) {
  if (values.size() < kDraws / 2) return std::nullopt;
  std::sort(values.begin(), values.end());
  const auto at = [&](double q) {
    return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
  };
  return Interval{at(0.025), at(0.975)};
}

}  // namespace

ErrorIntervals bootstrap_errors(const PointCloud& cloud, const Metrics& metrics) {
  ErrorIntervals out;
  std::vector<Group> groups = grouped(cloud, metrics, [](const CloudPoint& p) { return p.frame; });
  out.by_frame = groups.size() >= kFewFrames;
  if (!out.by_frame)
    groups = grouped(cloud, metrics, [](const CloudPoint& point) {
      const auto block = [&](int k) { return static_cast<long>(std::floor(point.p[k] / kBlock)); };
      return std::tuple(block(0), block(1), block(2));
    });
  out.groups = groups.size();
  if (groups.size() < 2) return out;
  std::vector<double> means, spreads, outliers;
  Draws draws;
  for (int k = 0; k < kDraws; ++k) {
    Group sum;
    for (std::size_t i = 0; i < groups.size(); ++i) sum.add(groups[draws.below(groups.size())]);
    if (sum.not_ground > 0) outliers.push_back(sum.outliers / sum.not_ground);
    if (sum.object < 2) continue;
    const double mean = sum.distance / sum.object;
    means.push_back(mean);
    const double squares = std::max(0.0, sum.distance_squared - sum.object * mean * mean);
    spreads.push_back(std::sqrt(squares / (sum.object - 1)));
  }
  out.mean = interval(std::move(means));
  out.stddev = interval(std::move(spreads));
  out.outliers = interval(std::move(outliers));
  return out;
}

}  // namespace tankrig
