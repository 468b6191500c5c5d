#include "calibration/laser_plane/stripe_points.hpp"

#include <algorithm>
#include <cmath>

namespace tankrig {
namespace {

/// A stripe as a function of the line, where it has points on both sides.
class StripeCurve {
 public:
  StripeCurve(const StripeLine& stripe, int most_gap) : stripe_(&stripe), most_gap_(most_gap) {}

  struct Value {
    double position, sigma;
  };
  std::optional<Value> at(double line) const {
    const auto& points = stripe_->points;
    const auto after = std::lower_bound(points.begin(), points.end(), line,
                                        [](const StripeLinePoint& p, double x) { return p.line < x; });
    if (after == points.end() || after == points.begin()) return std::nullopt;
    const StripeLinePoint &a = *(after - 1), &b = *after;
    if (b.line - a.line > most_gap_ + 1) return std::nullopt;
    const double share = (line - a.line) / (b.line - a.line);
    return Value{a.position + share * (b.position - a.position), std::max(a.sigma, b.sigma)};
  }

  /// How far a pixel lies beside the stripe, along the lines.
  std::optional<Value> beside(const Vector2d& pixel) const {
    const double line = stripe_->rows ? pixel.y() : pixel.x(), position = stripe_->rows ? pixel.x() : pixel.y();
    const auto value = at(line);
    if (!value) return std::nullopt;
    return Value{position - value->position, value->sigma};
  }

 private:
  const StripeLine* stripe_;
  int most_gap_;
};

std::optional<Vector3d> on_board(const CameraModel& camera, const Vector2d& pixel, const Plane& board) {
  const ViewingRay ray = camera.sight(pixel.x(), pixel.y());
  const double range = -board.distance(ray.origin) / board.normal.dot(ray.direction);
  if (!(range > 0 && range < 100)) return std::nullopt;
  return ray.at(range);
}

}  // namespace

std::vector<PlacedStripePoint> points_on_board(const CameraModel& camera, const StripeLine& stripe,
                                               const Transform& cMt, const BoardArea& area) {
  const Plane board = cMt * Plane{Vector3d::UnitZ(), 0};
  const Transform tMc = cMt.inverse();
  std::vector<PlacedStripePoint> out;
  for (StripeLinePoint point : stripe.points) {
    const auto p = on_board(camera, stripe.pixel(point), board);
    if (!p) continue;
    const Vector3d in_t = tMc * *p;
    if (in_t.x() < area.min.x() || in_t.y() < area.min.y() || in_t.x() > area.max.x() || in_t.y() > area.max.y())
      continue;
    point.position += point.sigma;
    const auto moved = on_board(camera, stripe.pixel(point), board);
    if (moved) out.push_back({*p, (*moved - *p).norm()});
  }
  return out;
}

std::vector<PlacedStripePoint> points_by_stereo(const CameraModel& left, const CameraModel& right, const Transform& cMr,
                                                const StripeLine& left_stripe, const StripeLine& right_stripe,
                                                const StereoStripeParameters& parameters) {
  constexpr int kSteps = 400;
  const StripeCurve curve(right_stripe, parameters.most_gap);
  const Transform rMc = cMr.inverse();
  const double from = 1 / parameters.farthest, to = 1 / parameters.nearest;
  std::vector<PlacedStripePoint> out;
  for (const StripeLinePoint& point : left_stripe.points) {
    const Vector2d pixel = left_stripe.pixel(point);
    const ViewingRay ray = left.sight(pixel.x(), pixel.y());
    // Beside the right stripe as a function of inverse range.
    const auto beside = [&](double inverse) -> std::optional<StripeCurve::Value> {
      const auto there = right.project(rMc * (ray.origin + ray.direction / inverse));
      return there ? curve.beside(*there) : std::nullopt;
    };
    int crossings = 0;
    double low = 0, high = 0;
    std::optional<double> before;
    for (int i = 0; i <= kSteps; ++i) {
      const double inverse = from + (to - from) * i / kSteps;
      const auto now = beside(inverse);
      if (now && before && (*before < 0) != (now->position < 0)) {
        ++crossings;
        low = inverse - (to - from) / kSteps, high = inverse;
      }
      before = now ? std::optional(now->position) : std::nullopt;
    }
    if (crossings != 1) continue;
    const double at_low = beside(low)->position, at_high = beside(high)->position;
    double a = low, b = high;
    for (int i = 0; i < 40; ++i) {
      const double middle = 0.5 * (a + b);
      const auto value = beside(middle);
      if (!value) break;
      ((value->position < 0) == (at_low < 0) ? a : b) = middle;
    }
    const double inverse = 0.5 * (a + b), slope = (at_high - at_low) / (high - low);
    const auto there = beside(inverse);
    if (!there) continue;
    // The left point's own error moves the epipolar line across the right stripe by about as much.
    const double sigma = std::hypot(point.sigma, there->sigma) / std::abs(slope) / (inverse * inverse);
    if (!(sigma <= parameters.most_sigma)) continue;
    out.push_back({ray.origin + ray.direction / inverse, sigma});
  }
  return out;
}

}  // namespace tankrig
