#include "reconstruction/stripe/fit/section_colour.hpp"

#include <algorithm>
#include <cmath>

#include "reconstruction/stripe/find/clipped_runs.hpp"
#include "reconstruction/stripe/fit/cut_profile.hpp"

namespace tankrig {

bool is_another_colour(const Eigen::Vector3d& light, double tolerance, const Eigen::Vector3d& stripe) {
  constexpr double kMaxAngle = 0.35;
  const double along = light.dot(stripe), across = (light - along * stripe).norm();
  return across >= tolerance && across >= std::tan(kMaxAngle) * along;
}

SectionColour SectionColours::at(int column, double row) const {
  SectionColour colour;
  const int channels = image_.channels(), centre = static_cast<int>(std::lround(row));
  const int first = centre - reach_, last = centre + reach_;
  if (channels < 3 || first < 1 || last + 1 >= image_.rows) return colour;
  const bool dark = !background_.empty();
  const auto light = [&](int y, int c) {
    const auto at = static_cast<std::ptrdiff_t>(column) * channels + c;
    return static_cast<double>(image_.ptr<std::uint8_t>(y)[at] - (dark ? background_.ptr<std::uint8_t>(y)[at] : 0));
  };
  const auto is_clipped = [](const std::uint8_t* pixel) { return std::max({pixel[0], pixel[1], pixel[2]}) >= kKnee; };
  Eigen::Vector3d base = Eigen::Vector3d::Zero();
  double darkest = HUGE_VAL, brightest = 0;
  for (const int y : {first - 1, first, last, last + 1}) {
    colour.hidden |= is_clipped(image_.ptr<std::uint8_t>(y, column));
    const Eigen::Vector3d end(light(y, 0), light(y, 1), light(y, 2));
    base += 0.25 * end;
    if (!dark) darkest = std::min(darkest, end.norm()), brightest = std::max(brightest, end.norm());
  }
  if (colour.hidden) return colour;
  // Across an edge neither end is what lies under the stripe.
  if (!dark && differ_by_edge(darkest, brightest, appearance_.noise)) return colour;
  int used = 0, sums[3] = {};
  for (int y = first + 1; y < last; ++y) {
    const std::uint8_t* pixel = image_.ptr<std::uint8_t>(y, column);
    if (is_clipped(pixel)) continue;
    const std::uint8_t* unlit = dark ? background_.ptr<std::uint8_t>(y, column) : nullptr;
    for (int c = 0; c < 3; ++c) sums[c] += pixel[c] - (unlit ? unlit[c] : 0);
    ++used;
  }
  for (int c = 0; c < 3; ++c) colour.light[c] = sums[c] - used * base[c];
  colour.variance = appearance_.noise * appearance_.noise * (used + 0.25 * used * used);
  return colour;
}

SectionColours::Line SectionColours::line_at(const RidgeCandidates& candidates, int middle, double row,
                                             double max_step_px) const {
  constexpr int kReach = 6;
  Line line;
  for (int column = std::max(0, middle - kReach); column <= std::min(candidates.columns() - 1, middle + kReach);
       ++column)
    for (int k = 0; k < candidates.count(column); ++k) {
      const double found = candidates.at(column, k).row;
      if (std::abs(found - row) > max_step_px * std::abs(column - middle)) continue;
      line.columns += column != middle;
      line.colour += at(column, found);
      break;
    }
  return line;
}

SectionColours::Brightest SectionColours::brightest_at(int column, double row) const {
  const int middle = static_cast<int>(std::lround(row)), reach = static_cast<int>(std::ceil(appearance_.sd_px));
  Brightest brightest;
  for (int y = std::max(0, middle - reach); y <= std::min(image_.rows - 1, middle + reach); ++y) {
    const std::uint8_t* pixel = image_.ptr<std::uint8_t>(y, column);
    double light = 0;
    for (int c = 0; c < image_.channels(); ++c) {
      light += appearance_.light[c] * pixel[c];
      brightest.clips |= pixel[c] >= kFullScale;
    }
    brightest.light = std::max(brightest.light, light);
  }
  return brightest;
}

bool SectionColours::has_rival(const RidgeCandidates& candidates, const PathPoint& point,
                               const StripeParameters& parameters) const {
  constexpr int kNeeded = 9;
  for (int k = 0; k < candidates.count(point.column); ++k) {
    const RidgeCandidate& rival = candidates.at(point.column, k);
    if (std::abs(rival.row - point.candidate.row) < 4 * appearance_.sd_px + 2) continue;
    if (rival.snr < parameters.max_second_peak * point.candidate.snr) continue;
    // What clips is brighter than its signal says.
    const Brightest here = brightest_at(point.column, point.candidate.row);
    if (here.clips && brightest_at(point.column, rival.row).light < parameters.max_second_peak * here.light) continue;
    const Line line = line_at(candidates, point.column, rival.row, parameters.max_step_px);
    if (line.columns < kNeeded) continue;
    if (!differs(line.colour)) return true;
    if (differs(line_at(candidates, point.column, point.candidate.row, parameters.max_step_px).colour)) return true;
  }
  return false;
}

bool SectionColours::differs(const SectionColour& colour) const {
  if (!(appearance_.colour.norm() > 0)) return false;
  constexpr double kSigmas = 4;
  return is_another_colour(colour.light, kSigmas * std::sqrt(colour.variance), appearance_.colour.normalized());
}

}  // namespace tankrig
