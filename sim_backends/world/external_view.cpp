// A ray-cast drawing of the rig.
#include "sim_backends/world/external_view.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "sim_backends/world/laser_sheet.hpp"

namespace tankrig::sim {
namespace {

constexpr int kSamples = 3;     ///< along a pixel's side
constexpr float kEdge = 0.01f;  ///< difference of neighbouring pixels [linear, of white] from which all are drawn
constexpr int kSkyRays = 12;
constexpr float kFar = 100.0f;
constexpr float kOpen = 0.35f;  ///< free distance around a point that counts as open [m]

/// Straight lines of a box.
void add_edges(std::vector<Capsule>& bodies, const Vector3f& low, const Vector3f& high, float radius,
               const Rgb& colour) {
  const auto corner = [&](int k) {
    return Vector3f(k & 1 ? high.x() : low.x(), k & 2 ? high.y() : low.y(), k & 4 ? high.z() : low.z());
  };
  for (int k = 0; k < 8; ++k)
    for (const int bit : {1, 2, 4})
      if (!(k & bit)) bodies.push_back({corner(k), corner(k | bit), radius, colour});
}

void add_camera(std::vector<Capsule>& bodies, const CameraSpec& spec) {
  constexpr double kDepth = 0.17;
  const Rgb shell{0.10f, 0.11f, 0.13f}, wire{0.75f, 0.30f, 0.06f};
  const auto at = [&](const Vector3d& p) -> Vector3f { return (spec.wMc * p).cast<float>(); };
  bodies.push_back({at({0, 0, -0.11}), at({0, 0, -0.02}), 0.027f, shell});
  std::array<Vector3f, 4> corner;
  for (int k = 0; k < 4; ++k) {
    const double u = (k == 1 || k == 2) ? spec.model.width - 0.5 : -0.5, v = k >= 2 ? spec.model.height - 0.5 : -0.5;
    const Vector2d n = spec.model.normalized(u, v);
    corner[k] = at(kDepth * Vector3d(n.x(), n.y(), 1));
  }
  for (int k = 0; k < 4; ++k) {
    bodies.push_back({at({0, 0, 0}), corner[k], 0.0025f, wire});
    bodies.push_back({corner[k], corner[(k + 1) % 4], 0.0025f, wire});
  }
}

/// How far the fan reaches at each of its angles.
class FanReach {
 public:
  FanReach(const SheetPose& pose, double fan, const RenderGeometry& geometry, const std::vector<Capsule>& blockers)
      : half_(static_cast<float>(fan / 2)) {
    for (int i = 0; i < kSteps; ++i) {
      const float angle = half_ * (2 * (static_cast<float>(i) + 0.5f) / kSteps - 1);
      const Vector3f ray = std::cos(angle) * pose.forward + std::sin(angle) * pose.across;
      const auto wall = geometry.intersect(pose.exit, ray, kExitClearance);
      reach_[i] = wall ? wall->distance : kFar;
      if (const auto body = intersect(blockers, pose.exit, ray, kExitClearance, reach_[i])) reach_[i] = body->distance;
    }
  }
  float at(float angle) const {
    const int i = static_cast<int>((angle / half_ + 1) * 0.5f * kSteps);
    return i < 0 || i >= kSteps ? 0 : reach_[i];
  }

 private:
  static constexpr int kSteps = 2048;
  float half_;
  std::array<float, kSteps> reach_{};
};

class Drawing {
 public:
  Drawing(const Scene& scene, const RenderGeometry& geometry, const JointVector& q, bool laser_on)
      : scene_(scene),
        geometry_(geometry),
        laser_on_(laser_on),
        arm_(arm_bodies(scene.arm, scene.laser, q)),
        pose_(scene.arm.wMb * scene.arm.model.bMe(q) * scene.laser.eMl),
        reach_(pose_, scene.laser.fan, geometry, bodies_in_sheet(arm_, pose_)),
        day_(0.05f + 0.95f * static_cast<float>(scene.light)) {
    bodies_ = arm_;
    for (const CameraSpec& camera : scene.cameras) add_camera(bodies_, camera);
    for (const Lamp& lamp : scene.lamps) {
      const Vector3f p = lamp.position.cast<float>(), d = lamp.direction.normalized().cast<float>();
      bodies_.push_back({p - 0.05f * d, p, 0.022f, {0.9f, 0.85f, 0.6f}});
    }
    const Vector3f meter = scene.lux_meter.position.cast<float>();
    bodies_.push_back({meter, meter, 0.018f, {0.9f, 0.9f, 0.9f}});
    const Vector3f size = scene.tank.size.cast<float>();
    low_ = {-size.x() / 2, -size.y() / 2, 0};
    high_ = {size.x() / 2, size.y() / 2, size.z()};
    add_edges(bodies_, low_, high_, 0.005f, {0.16f, 0.20f, 0.24f});
  }

  /// The bodies that rays from `origin` within the planes through it with these inward normals may meet.
  std::vector<Capsule> bodies_between(const Vector3f& origin, const Vector3f& above, const Vector3f& below) const {
    std::vector<Capsule> near;
    for (const Capsule& c : bodies_) {
      const auto outside = [&](const Vector3f& inward) {
        return std::max(inward.dot(c.a - origin), inward.dot(c.b - origin)) < -c.radius;
      };
      if (!outside(above) && !outside(below)) near.push_back(c);
    }
    return near;
  }

  /// What neighbouring rays may share: the openness of one piece of surface.
  struct Nearby {
    Vector3f p = Vector3f::Constant(kFar), normal = Vector3f::Zero();
    float open = 1;
  };

  /// Linear colour along a ray from outside.
  Rgb colour(const Vector3f& origin, const Vector3f& ray, float height, const std::vector<Capsule>& bodies,
             Nearby& nearby) const {
    const auto body = intersect(bodies, origin, ray, 0, kFar);
    const auto wall = first_surface(origin, ray, body ? body->distance : kFar);
    float end = kFar;
    Rgb seen = Rgb{0.80f, 0.85f, 0.89f} * (0.72f + 0.28f * height);
    if (wall) {
      end = wall->distance;
      seen = shade(wall->p, wall->normal, paint(*wall), nearby);
      if (laser_on_) seen += stripe(*wall);
    } else if (body) {
      end = body->distance;
      seen = shade(origin + end * ray, body->normal, bodies[body->part].albedo, nearby);
    }
    seen = through_water(seen, origin, ray, end);
    return laser_on_ ? through_fan(seen, origin, ray, end) : seen;
  }

 private:
  /// The first surface before `end`, looking through walls from behind.
  std::optional<SurfaceHit> first_surface(const Vector3f& origin, const Vector3f& ray, float end) const {
    float from = 0;
    for (int tries = 0; tries < 4; ++tries) {
      const auto hit = geometry_.intersect(origin, ray, from);
      if (!hit || hit->distance >= end) return std::nullopt;
      const auto& surface = geometry_.surface(hit->surface);
      if (surface.kind == RenderGeometry::Kind::kObject) return hit;
      const Vector3f inward = surface.kind == RenderGeometry::Kind::kFloor ? Vector3f::UnitZ() : surface.inward;
      if (inward.dot(ray) < 0) return hit;
      from = hit->distance + 1e-4f;
    }
    return std::nullopt;
  }

  Rgb paint(const SurfaceHit& hit) const {
    const Rgb albedo = geometry_.albedo(hit);
    if (geometry_.surface(hit.surface).kind != RenderGeometry::Kind::kWall) return albedo;
    const float waterline = std::abs(hit.p.z() - static_cast<float>(scene_.tank.water_depth));
    return waterline < 0.005f ? Rgb(0.85f, 0.93f, 0.97f) : albedo;
  }

  Rgb shade(const Vector3f& p, const Vector3f& normal, const Rgb& albedo, Nearby& nearby) const {
    static const Vector3f kKey = Vector3f(0.35f, -0.45f, 0.82f).normalized();
    const Vector3f origin = p + 1e-3f * normal;
    const float facing = std::max(0.0f, normal.dot(kKey));
    const bool lit = facing > 0 && !blocked(origin, kKey, kFar);
    if (nearby.normal.dot(normal) < 0.9f || (nearby.p - p).squaredNorm() > 1e-3f)
      nearby = {p, normal, openness(origin, normal)};
    return albedo * day_ * (Rgb(1.20f, 1.16f, 1.08f) * (lit ? facing : 0.0f) + Rgb(0.62f, 0.68f, 0.74f) * nearby.open);
  }

  /// Walls do not block the draughtsman's lamp.
  bool blocked(const Vector3f& origin, const Vector3f& ray, float to) const {
    if (const auto hit = geometry_.intersect(origin, ray);
        hit && hit->distance < to && geometry_.surface(hit->surface).kind == RenderGeometry::Kind::kObject)
      return true;
    return intersect(arm_, origin, ray, 1e-3f, to).has_value();
  }

  /// Share of near surroundings that is free.
  float openness(const Vector3f& origin, const Vector3f& normal) const {
    std::vector<Capsule> near;
    for (const Capsule& c : arm_) {
      const Vector3f middle = 0.5f * (c.a + c.b);
      if ((middle - origin).norm() < kOpen + c.radius + 0.5f * (c.b - c.a).norm()) near.push_back(c);
    }
    const Vector3f a = (std::abs(normal.z()) < 0.9f ? Vector3f::UnitZ() : Vector3f::UnitX()).cross(normal).normalized();
    const Vector3f b = normal.cross(a);
    float sum = 0;
    for (int k = 0; k < kSkyRays; ++k) {
      const float s = (static_cast<float>(k) + 0.5f) / kSkyRays, angle = 2.399963f * static_cast<float>(k);
      const Vector3f ray = std::sqrt(s) * (std::cos(angle) * a + std::sin(angle) * b) + std::sqrt(1 - s) * normal;
      const auto hit = geometry_.intersect(origin, ray);
      float distance = hit ? hit->distance : kFar;
      if (const auto body = intersect(near, origin, ray, 1e-3f, distance)) distance = body->distance;
      sum += std::min(1.0f, 0.25f + 0.75f * distance / kOpen);
    }
    return sum / kSkyRays;
  }

  Rgb stripe(const SurfaceHit& hit) const {
    const float x = pose_.distance(hit.p);
    if (std::abs(x) > 0.02f) return Rgb::Zero();
    const Vector3f way = hit.p - pose_.exit;
    const float angle = std::atan2(pose_.across.dot(way), pose_.forward.dot(way));
    if (std::abs(angle) > 0.5 * scene_.laser.fan || !laser_reaches(pose_, hit.p, hit.normal, geometry_, arm_))
      return Rgb::Zero();
    const float core = std::exp(-0.5f * x * x / (0.003f * 0.003f)), halo = std::exp(-0.5f * x * x / (0.009f * 0.009f));
    return Rgb(0.45f, 1.6f, 0.5f) * core + Rgb(0.01f, 0.22f, 0.03f) * halo;
  }

  Rgb through_water(const Rgb& seen, const Vector3f& origin, const Vector3f& ray, float end) const {
    float enter = 0, leave = end;
    const Vector3f high{high_.x(), high_.y(), static_cast<float>(scene_.tank.water_depth)};
    for (int k = 0; k < 3; ++k) {
      const float a = (low_[k] - origin[k]) / ray[k], b = (high[k] - origin[k]) / ray[k];
      enter = std::max(enter, std::min(a, b)), leave = std::min(leave, std::max(a, b));
    }
    if (leave <= enter) return seen;
    const Rgb left = (-Rgb(0.26f, 0.075f, 0.045f) * (leave - enter)).exp();
    return seen * left + Rgb(0.10f, 0.36f, 0.46f) * (1 - left) * 0.7f * day_;
  }

  Rgb through_fan(const Rgb& seen, const Vector3f& origin, const Vector3f& ray, float end) const {
    const float t = -pose_.distance(origin) / pose_.normal.dot(ray);
    if (!(t > 0) || t >= end) return seen;
    const Vector3f way = origin + t * ray - pose_.exit;
    const float range = way.norm(), angle = std::atan2(pose_.across.dot(way), pose_.forward.dot(way));
    if (range > reach_.at(angle)) return seen;
    const float alpha = 0.13f + 0.25f * std::exp(-range / 0.35f);
    return seen * (1 - alpha) + alpha * Rgb(0.12f, 0.95f, 0.22f);
  }

  const Scene& scene_;
  const RenderGeometry& geometry_;
  bool laser_on_;
  std::vector<Capsule> arm_, bodies_;
  SheetPose pose_;
  FanReach reach_;
  float day_;  ///< the lamp, dimmed with the scene's light: never so far that nothing is seen
  Vector3f low_, high_;
};

std::uint8_t encode(float linear) {
  const float v = std::pow(std::clamp(linear, 0.0f, 1.0f), 1 / 2.2f);
  return static_cast<std::uint8_t>(255 * v + 0.5f);
}

}  // namespace

cv::Mat external_view(const Scene& scene, const RenderGeometry& geometry, const JointVector& q, bool laser_on,
                      int width, int height) {
  const Drawing drawing(scene, geometry, q, laser_on);
  const Vector3f size = scene.tank.size.cast<float>();
  const Vector3f target{0, 0, 0.40f * size.z()};
  const Vector3f eye = target + Vector3f(-1.05f * size.x(), -1.70f * size.y(), 1.35f * size.z());
  const Vector3f forward = (target - eye).normalized(), right = forward.cross(Vector3f::UnitZ()).normalized();
  const Vector3f down = forward.cross(right);
  const float aspect = static_cast<float>(width) / static_cast<float>(height);
  const float half_width = 0.44f * std::max(1.0f, aspect / 1.25f), half_height = half_width / aspect;

  const auto row_direction = [&](int row) -> Vector3f {
    return forward + (2 * static_cast<float>(row) / static_cast<float>(height) - 1) * half_height * down;
  };
  const auto draw_row = [&](int v, const auto& drawn) {
    const auto bodies = drawing.bodies_between(eye, row_direction(v).cross(right).normalized(),
                                               right.cross(row_direction(v + 1)).normalized());
    for (int u = 0; u < width; ++u) {
      Drawing::Nearby nearby;
      drawn(u, [&](int sample) -> Rgb {
        const float su = (static_cast<float>(u) + (static_cast<float>(sample % kSamples) + 0.5f) / kSamples) /
                         static_cast<float>(width);
        const float sv = (static_cast<float>(v) + (static_cast<float>(sample / kSamples) + 0.5f) / kSamples) /
                         static_cast<float>(height);
        const Vector3f ray =
            (forward + (2 * su - 1) * half_width * right + (2 * sv - 1) * half_height * down).normalized();
        return drawing.colour(eye, ray, 1 - sv, bodies, nearby).min(1.2f);
      });
    }
  };

  // The middle of each pixel first: where it differs from a neighbour's, there is an edge, and all samples are drawn.
  constexpr int kMiddle = kSamples * kSamples / 2;
  cv::Mat3f middle(height, width);
  tbb::parallel_for(0, height, [&](int v) {
    draw_row(v, [&](int u, const auto& sample) {
      const Rgb c = sample(kMiddle);
      middle(v, u) = {c[2], c[1], c[0]};
    });
  });
  cv::Mat least, most;
  cv::erode(middle, least, cv::Mat());
  cv::dilate(middle, most, cv::Mat());
  cv::Mat image(height, width, CV_8UC3);
  tbb::parallel_for(0, height, [&](int v) {
    draw_row(v, [&](int u, const auto& sample) {
      cv::Vec3f sum = middle(v, u);
      const cv::Vec3f contrast = most.at<cv::Vec3f>(v, u) - least.at<cv::Vec3f>(v, u);
      if (*std::max_element(contrast.val, contrast.val + 3) > kEdge) {
        for (int k = 0; k < kSamples * kSamples; ++k)
          if (k != kMiddle) {
            const Rgb c = sample(k);
            sum += cv::Vec3f(c[2], c[1], c[0]);
          }
        sum /= kSamples * kSamples;
      }
      image.at<cv::Vec3b>(v, u) = {encode(sum[0]), encode(sum[1]), encode(sum[2])};
    });
  });
  return image;
}

}  // namespace tankrig::sim
