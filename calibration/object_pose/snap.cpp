#include "calibration/object_pose/snap.hpp"

#include <fmt/core.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "calibration/estimate/differentiable.hpp"
#include "core/angles.hpp"
#include "core/median.hpp"

namespace tankrig {
namespace {

constexpr double kSmoothing_px = 1;        // sigma, before the steps are looked for
constexpr double kFromCorners = 0.06;      // of an edge's length, left out at both ends: other edges begin there
constexpr double kLeastStep = 2;           // grey levels in a pixel
constexpr std::size_t kLeastPlaces = 10;   // on a line
constexpr double kMostScatter_px = 0.7;    // of the places about their line
constexpr double kLeastShare = 0.5;        // of the places looked at that belong to it
constexpr double kCorrelated = 3;          // places that err alike, by the smoothing
constexpr double kLeastCrossing_deg = 12;  // of the lines that meet in a corner
constexpr double kLeastReach_px = 1.5;     // two edges closer than twice this are not told apart
constexpr double kReachFromClicks_px = 10, kReachFromPose_px = 3;
constexpr double kClickSigmas = 4;            // farther off is the edge of something else, as of the object's shadow
constexpr double kLeastSigma_px = 0.01;       // of a line
constexpr double kEdgeSigma_px = 0.1;         // of a corner: light and texture beside its edges move it, too
constexpr double kMostDisagreement_px = 0.4;  // of a snapped corner with the pose of all
constexpr std::size_t kFewestAgreeing = 5;    // corners that outvote one or two
constexpr std::ptrdiff_t kFewestBelieved = 3;
constexpr double kTogether_px = 0.5;      // that clicks err alike, which their scatter does not tell
constexpr double kMostContradiction = 8;  // right clicks exceed it once in a hundred times

/// A line in the undistorted picture: normal . ray + offset = 0, and how well it is known.
struct ImageLine {
  Vector2d normal = Vector2d::UnitX();
  double offset = 0;
  Vector2d middle = Vector2d::Zero();  ///< of its places
  double spread = 0;                   ///< root mean square of the places along it
  double scatter = 0;                  ///< of the places across it
  double independent = 0;              ///< places

  Vector2d along() const { return {-normal.y(), normal.x()}; }
  double variance_at(const Vector2d& p) const {
    const double t = along().dot(p - middle) / spread;
    return scatter * scatter * (1 + t * t) / independent;
  }
};

double grey_at(const cv::Mat& smooth, const Vector2d& p) {
  const int u = static_cast<int>(std::floor(p.x())), v = static_cast<int>(std::floor(p.y()));
  const double fu = p.x() - u, fv = p.y() - v;
  const float *upper = smooth.ptr<float>(v) + u, *lower = smooth.ptr<float>(v + 1) + u;
  return (1 - fv) * ((1 - fu) * upper[0] + fu * upper[1]) + fv * ((1 - fu) * lower[0] + fu * lower[1]);
}

/// Where brightness changes most on the way from `from` - reach to + reach along `across`; nothing if it hardly does.
std::optional<Vector2d> step_at(const cv::Mat& smooth, const Vector2d& from, const Vector2d& across, double reach) {
  constexpr double kStride = 0.5;
  const int half = static_cast<int>(std::ceil(reach / kStride));
  const double rim = reach + 2;
  if (from.x() < rim || from.y() < rim || from.x() > smooth.cols - 2 - rim || from.y() > smooth.rows - 2 - rim)
    return std::nullopt;
  std::vector<double> slope(static_cast<std::size_t>(2 * half + 1));
  int best = 0;
  double most = 0;
  for (int k = -half; k <= half; ++k) {
    const Vector2d at = from + kStride * k * across;
    const double s = std::abs(grey_at(smooth, at + 0.5 * across) - grey_at(smooth, at - 0.5 * across));
    slope[static_cast<std::size_t>(k + half)] = s;
    if (s > most) most = s, best = k + half;
  }
  if (most < kLeastStep || best == 0 || best == 2 * half) return std::nullopt;
  const auto b = static_cast<std::size_t>(best);
  const double bend = slope[b - 1] - 2 * slope[b] + slope[b + 1];
  const double part = bend < 0 ? 0.5 * (slope[b - 1] - slope[b + 1]) / bend : 0;
  return from + kStride * (best - half + part) * across;
}

/// Least squares of weighted places; the line's `scatter` is weighted too.
ImageLine line_through(const std::vector<Vector2d>& places, const std::vector<double>& weights) {
  double sum = 0;
  ImageLine line;
  for (std::size_t k = 0; k < places.size(); ++k) sum += weights[k], line.middle += weights[k] * places[k];
  line.middle /= sum;
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Vector2d d = places[k] - line.middle;
    moments += weights[k] / sum * d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(moments);
  line.normal = eigen.eigenvectors().col(0);
  line.offset = -line.normal.dot(line.middle);
  line.scatter = std::sqrt(std::max(0.0, eigen.eigenvalues()[0]));
  line.spread = std::sqrt(eigen.eigenvalues()[1]);
  line.independent = sum / kCorrelated;
  return line;
}

/// The line most places agree with: through the pair whose median distance is least, then re-weighted (Tukey).
std::optional<ImageLine> robust_line(const std::vector<Vector2d>& places, double pixel) {
  if (places.size() < kLeastPlaces) return std::nullopt;
  const auto distances = [&](const ImageLine& line) {
    std::vector<double> out;
    for (const Vector2d& p : places) out.push_back(std::abs(line.normal.dot(p) + line.offset));
    return out;
  };
  std::optional<ImageLine> best;
  double least = kMostScatter_px * pixel;
  const std::size_t stride = std::max<std::size_t>(1, places.size() / 24);
  for (std::size_t a = 0; a < places.size(); a += stride)
    for (std::size_t b = a + places.size() / 4; b < places.size(); b += stride) {
      ImageLine line;
      const Vector2d way = (places[b] - places[a]).normalized();
      line.normal = {way.y(), -way.x()};
      line.offset = -line.normal.dot(places[a]);
      std::vector<double> all = distances(line);
      if (const double median = upper_median(all); median < least) least = median, best = line;
    }
  if (!best) return std::nullopt;
  for (int round = 0; round < 10; ++round) {
    std::vector<double> all = distances(*best), sorted = all;
    const double limit = 4.685 * std::max(1.4826 * upper_median(sorted), 0.02 * pixel);
    std::vector<double> weights;
    double sum = 0;
    for (const double d : all) {
      const double share = d < limit ? 1 - d * d / (limit * limit) : 0;
      weights.push_back(share * share);
      sum += weights.back();
    }
    if (sum < static_cast<double>(kLeastPlaces) || sum < kLeastShare * static_cast<double>(places.size()))
      return std::nullopt;
    best = line_through(places, weights);
  }
  return best;
}

/// The edge in the picture, bent as the lens bends it.
std::vector<Vector2d> drawn(const CameraModel& camera, const Transform& cMo, const ObjectShape::Edge& edge) {
  constexpr int kParts = 16;
  std::vector<Vector2d> line;
  for (int k = 0; k <= kParts; ++k)
    if (const auto pixel = camera.project(cMo * Vector3d(edge.a + (edge.b - edge.a) * k / kParts)))
      line.push_back(*pixel);
  return line;
}

/// How far from `from` the first of `lines` crosses the way along `across`, to either side [px].
double first_crossing(const Vector2d& from, const Vector2d& across, const std::vector<std::vector<Vector2d>>& lines) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const std::vector<Vector2d>& line : lines)
    for (std::size_t k = 0; k + 1 < line.size(); ++k) {
      const Vector2d part = line[k + 1] - line[k], to = line[k] - from;
      const double area = across.x() * part.y() - across.y() * part.x();
      if (std::abs(area) < 1e-9) continue;
      const double along = (to.x() * across.y() - to.y() * across.x()) / area;
      if (along >= 0 && along <= 1)
        nearest = std::min(nearest, std::abs(to.x() * part.y() - to.y() * part.x()) / std::abs(area));
    }
  return nearest;
}

/// `others`: edges that are seen too. Where one runs beside this edge, only the half of the way to it is searched.
std::optional<ImageLine> line_of_edge(const cv::Mat& smooth, const CameraModel& camera, const Transform& cMo,
                                      const ObjectShape::Edge& edge, double reach,
                                      const std::vector<std::vector<Vector2d>>& others) {
  const auto a = camera.project(cMo * edge.a), b = camera.project(cMo * edge.b);
  if (!a || !b) return std::nullopt;
  const int count = static_cast<int>((*b - *a).norm());
  std::vector<Vector2d> places;
  int searched = 0;
  for (int k = 1; k < count; ++k) {
    // Equal steps in the picture, nearly: the edge's own perspective matters little between its ends.
    const double t = kFromCorners + (1 - 2 * kFromCorners) * k / count;
    const auto at = camera.project(cMo * Vector3d(edge.a + t * (edge.b - edge.a))),
               next = camera.project(cMo * Vector3d(edge.a + (t + 0.01) * (edge.b - edge.a)));
    if (!at || !next || (*next - *at).norm() < 1e-6) continue;
    const Vector2d along = (*next - *at).normalized(), across(-along.y(), along.x());
    const double free = std::min(reach, first_crossing(*at, across, others) / 2);
    if (free < kLeastReach_px) continue;
    ++searched;
    const double depth = (cMo * Vector3d(edge.a + t * (edge.b - edge.a))).z();
    if (const auto step = step_at(smooth, *at, across, free))
      places.push_back(camera.normalized(step->x(), step->y(), depth));
  }
  if (static_cast<double>(places.size()) < kLeastShare * searched) return std::nullopt;
  return robust_line(places, 1 / camera.fx);
}

/// Searches along the object's edges, as the pose expects them, for the strongest step in brightness, fits a robust line to each edge
/// in the undistorted picture and puts each corner where its lines meet.
/// `reach_px`: how far from its expected place an edge may be. `most_px`: how far from its click a corner.
std::vector<SnappedCorner> snap(const cv::Mat& grey, const CameraModel& camera, const ObjectShape& shape,
                                const Transform& cMo, const std::vector<ClickedCorner>& clicked, double reach_px,
                                double most_px) {
  cv::Mat smooth;
  grey.convertTo(smooth, CV_32F);
  cv::GaussianBlur(smooth, smooth, {0, 0}, kSmoothing_px);
  const double same = 1e-4 * shape.size();
  const Vector3d eye = cMo.inverse().translation();
  std::vector<std::vector<Vector2d>> seen;  // empty: hidden
  for (const ObjectShape::Edge& edge : shape.edges()) {
    const bool visible = shape.sees(eye, 0.8 * edge.a + 0.2 * edge.b) && shape.sees(eye, (edge.a + edge.b) / 2) &&
                         shape.sees(eye, 0.2 * edge.a + 0.8 * edge.b);
    seen.push_back(visible ? drawn(camera, cMo, edge) : std::vector<Vector2d>());
  }
  std::vector<std::optional<ImageLine>> lines;
  for (std::size_t k = 0; k < shape.edges().size(); ++k) {
    const ObjectShape::Edge& edge = shape.edges()[k];
    const bool wanted = std::any_of(clicked.begin(), clicked.end(), [&](const ClickedCorner& c) {
      return (c.o - edge.a).norm() < same || (c.o - edge.b).norm() < same;
    });
    std::vector<std::vector<Vector2d>> others = seen;
    others[k].clear();
    lines.push_back(wanted && !seen[k].empty() ? line_of_edge(smooth, camera, cMo, edge, reach_px, others)
                                               : std::nullopt);
  }
  std::vector<SnappedCorner> out;
  for (const ClickedCorner& c : clicked) {
    SnappedCorner result{c, "", 0};
    std::vector<ImageLine> meeting;
    for (std::size_t k = 0; k < lines.size(); ++k)
      if (lines[k] && ((c.o - shape.edges()[k].a).norm() < same || (c.o - shape.edges()[k].b).norm() < same))
        meeting.push_back(*lines[k]);
    result.edges = static_cast<int>(meeting.size());
    double crossing = 0;
    for (const ImageLine& a : meeting)
      for (const ImageLine& b : meeting)
        crossing = std::max(crossing, std::abs(a.normal.x() * b.normal.y() - a.normal.y() * b.normal.x()));
    if (meeting.size() < 2) {
      result.why_not =
          fmt::format("{} of its edges {} clear in the picture", meeting.size(), meeting.size() == 1 ? "is" : "are");
    } else if (crossing < std::sin(from_degrees(kLeastCrossing_deg))) {
      result.why_not = "its edges hardly cross";
    } else {
      const double depth = camera.port ? (cMo * c.o).z() : 1;
      Vector2d place = camera.normalized(c.pixel.x(), c.pixel.y(), depth);
      Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
      for (int round = 0; round < 3; ++round) {  // a line's weight depends on where it is asked
        information.setZero();
        Vector2d right = Vector2d::Zero();
        for (const ImageLine& line : meeting) {
          const double floor = kLeastSigma_px / camera.fx, weight = 1 / (line.variance_at(place) + floor * floor);
          information += weight * line.normal * line.normal.transpose();
          right -= weight * line.offset * line.normal;
        }
        place = information.inverse() * right;
      }
      const auto pixel = camera.project(depth * place.homogeneous());
      if (!pixel || (*pixel - c.pixel).norm() > most_px) {
        result.why_not = pixel ? fmt::format("its edges meet {:.1f} px from the click, expected {:.1f} px and less",
                                             (*pixel - c.pixel).norm(), most_px)
                               : "its edges meet where the lens sees nothing";
      } else {
        result.corner.pixel = *pixel;
        result.corner.sigma = std::hypot(kEdgeSigma_px, camera.fx * std::sqrt(information.inverse().trace() / 2));
      }
    }
    out.push_back(result);
  }
  return out;
}

/// How far the worst of the snapped corners, but for those `without`, lies from where the pose has it [px].
double farthest(const ObjectPoseSolution& pose, const std::vector<SnappedCorner>& corners,
                const std::vector<std::size_t>& without = {}) {
  double most = 0;
  for (std::size_t k = 0; k < corners.size(); ++k)
    if (corners[k].why_not.empty() && std::ranges::find(without, k) == without.end())
      most = std::max(most, pose.residuals_px[k].norm());
  return most;
}

/// The pose of those corners that agree with each other. Up to two without which the others agree stay as clicked: the
/// edge of something else was taken for theirs.
ObjectPoseSolution solve_agreeing(const ObjectPoseProblem& clicked, std::vector<SnappedCorner>& corners) {
  ObjectPoseProblem snapped = clicked;
  std::vector<std::size_t> moved;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    snapped.corners[k] = corners[k].corner;
    if (corners[k].why_not.empty()) moved.push_back(k);
  }
  ObjectPoseSolution best = solve(snapped);
  double least = kMostDisagreement_px;
  if (farthest(best, corners) < least) return best;
  std::vector<std::size_t> left_out;
  const auto attempt = [&](const std::vector<std::size_t>& without) {
    ObjectPoseProblem problem = snapped;
    for (const std::size_t k : without) problem.corners[k] = clicked.corners[k];
    ObjectPoseSolution pose = solve(problem);
    const double most = farthest(pose, corners, without);
    if (most < least) least = most, best = std::move(pose), left_out = without;
  };
  for (std::size_t count = 1; count <= 2 && left_out.empty() && moved.size() >= kFewestAgreeing + count; ++count)
    for (std::size_t i = 0; i < moved.size(); ++i) {
      if (count == 1) attempt({moved[i]});
      for (std::size_t j = i + 1; count == 2 && j < moved.size(); ++j) attempt({moved[i], moved[j]});
    }
  for (const std::size_t k : left_out) {
    const auto expected = clicked.camera.project(best.cMo * clicked.corners[k].o);
    corners[k].why_not = fmt::format("its edges meet {:.1f} px from where the other corners put it",
                                     expected ? (corners[k].corner.pixel - *expected).norm() : HUGE_VAL);
    corners[k].corner = clicked.corners[k];
  }
  return best;
}

/// By how much more a pose misses the clicks than their own does, over how much they err: Fisher's F of a pose's numbers.
double contradiction(const ObjectPoseProblem& clicked, const ObjectPoseSolution& raw, const Transform& cMo) {
  double by_raw = 0, by_other = 0;
  for (std::size_t k = 0; k < clicked.corners.size(); ++k) {
    const ClickedCorner& c = clicked.corners[k];
    const auto expected = clicked.camera.project(cMo * c.o);
    if (!expected) return HUGE_VAL;
    by_raw += raw.residuals_px[k].squaredNorm() / (c.sigma * c.sigma);
    by_other += (*expected - c.pixel).squaredNorm() / (c.sigma * c.sigma);
  }
  return (by_other - by_raw) / kPoseStep / std::pow(std::max(raw.sigma_px, kTogether_px), 2);
}

/// Empty: the snapped corners are to be believed.
std::string why_not_believed(const ObjectPoseProblem& clicked, const SnappedPose& pose) {
  if (std::ranges::count(pose.corners, "", &SnappedCorner::why_not) < kFewestBelieved)
    return fmt::format("fewer than {} corners can be snapped", kFewestBelieved);
  if (farthest(pose.snapped, pose.corners) > std::max(kMostDisagreement_px, pose.raw.sigma_px))
    return "the snapped corners contradict each other";
  if (contradiction(clicked, pose.raw, pose.snapped.cMo) > kMostContradiction)
    return "the snapped corners contradict the clicks";
  return {};
}

}  // namespace

SnappedPose solve_with_snapping(const cv::Mat& grey, const ObjectPoseProblem& problem) {
  SnappedPose out;
  out.raw = solve(problem);
  Transform cMo = out.raw.cMo;
  const double astray = kClickSigmas * out.raw.sigma_px;
  const double first = std::clamp(astray, kReachFromPose_px, kReachFromClicks_px),
               most = std::clamp(astray, kLeastReach_px, kReachFromClicks_px);
  for (const double reach : {first, kReachFromPose_px, kReachFromPose_px}) {
    out.corners = snap(grey, problem.camera, problem.shape, cMo, problem.corners, reach, most);
    out.snapped = solve_agreeing(problem, out.corners);
    cMo = out.snapped.cMo;
  }
  const std::string why_not = why_not_believed(problem, out);
  if (why_not.empty()) return out;
  out.snapped = out.raw;
  for (std::size_t k = 0; k < out.corners.size(); ++k) {
    if (out.corners[k].why_not.empty()) out.corners[k].why_not = why_not;
    out.corners[k].corner = problem.corners[k];
  }
  return out;
}

}  // namespace tankrig
