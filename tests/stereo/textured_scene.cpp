// Ray casting on rectangles with a texture of value noise.
#include "tests/stereo/textured_scene.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace tankrig::testing {
namespace {

double lattice(std::int64_t i, std::int64_t j, std::uint64_t layer) {
  std::uint64_t h = static_cast<std::uint64_t>(i) * 0x9E3779B97F4A7C15ull ^
                    static_cast<std::uint64_t>(j) * 0xC2B2AE3D27D4EB4Full ^ (layer + 1) * 0x165667B19E3779F9ull;
  h = (h ^ (h >> 30)) * 0xBF58476D1CE4E5B9ull;
  h = (h ^ (h >> 27)) * 0x94D049BB133111EBull;
  return static_cast<double>((h ^ (h >> 31)) >> 11) * 0x1p-53;
}

double value_noise(double x, double y, std::uint64_t layer) {
  const double fx = std::floor(x), fy = std::floor(y);
  const auto i = static_cast<std::int64_t>(fx);
  const auto j = static_cast<std::int64_t>(fy);
  const auto smooth = [](double t) { return t * t * t * (t * (6 * t - 15) + 10); };
  const double s = smooth(x - fx), t = smooth(y - fy);
  const double low = lattice(i, j, layer) * (1 - s) + lattice(i + 1, j, layer) * s;
  const double high = lattice(i, j + 1, layer) * (1 - s) + lattice(i + 1, j + 1, layer) * s;
  return low * (1 - t) + high * t;
}

/// Reflectance at (s, t) metres on a rectangle, about 0.05 to 0.95.
double texture(double s, double t, double contrast, std::uint64_t face) {
  double sum = 0;
  const double cell_m[] = {0.024, 0.011, 0.006, 0.004};
  for (std::uint64_t k = 0; k < 4; ++k) sum += value_noise(s / cell_m[k], t / cell_m[k], 7 * face + k) - 0.5;
  return std::clamp(0.5 + 0.45 * contrast * sum, 0.02, 0.98);
}

double grey_on_ray(const TexturedScene& scene, const Vector3d& origin, const Vector3d& direction) {
  double nearest = std::numeric_limits<double>::infinity();
  double grey = 0;
  for (std::size_t i = 0; i < scene.rectangles.size(); ++i) {
    const TexturedRectangle& r = scene.rectangles[i];
    const Vector3d n = r.normal();
    const double slope = n.dot(direction);
    if (std::abs(slope) < 1e-9) continue;
    const double range = n.dot(r.centre - origin) / slope;
    if (range <= 0 || range >= nearest) continue;
    const Vector3d p = origin + range * direction - r.centre;
    const double s = p.dot(r.half_u.normalized());
    const double t = p.dot(r.half_v.normalized());
    if (std::abs(s) > r.half_u.norm() || std::abs(t) > r.half_v.norm()) continue;
    nearest = range;
    const double shade = 0.5 + 0.5 * std::abs(n.dot(Vector3d(0.3, -0.5, 0.81)));
    grey = 235.0 * scene.light * shade * texture(s, t, r.contrast, i);
  }
  return grey;
}

cv::Mat1f image(const TexturedScene& scene, const CameraModel& camera, const Transform& cMcamera, int supersampling) {
  cv::Mat1f out(camera.height, camera.width);
  tbb::parallel_for(0, camera.height, [&](int v) {
    for (int u = 0; u < camera.width; ++u) {
      double sum = 0;
      for (int i = 0; i < supersampling * supersampling; ++i) {
        const double du = (i % supersampling + 0.5) / supersampling - 0.5;
        const double dv = (i / supersampling + 0.5) / supersampling - 0.5;
        const ViewingRay ray =
            cMcamera * (camera.port ? camera.sight(u + du, v + dv)
                                    : ViewingRay{Vector3d::Zero(), camera.normalized(u + du, v + dv).homogeneous()});
        sum += grey_on_ray(scene, ray.origin, ray.direction);
      }
      out(v, u) = static_cast<float>(sum / (supersampling * supersampling));
    }
  });
  return out;
}

void draw_particle(cv::Mat1f& image, const CameraModel& camera, const Vector3d& p, double radius) {
  const auto pixel = camera.project(p);
  if (!pixel) return;
  const double r = radius * camera.fx / p.z();
  for (int v = std::max(0, static_cast<int>(pixel->y() - r)); v <= std::min(image.rows - 1.0, pixel->y() + r); ++v)
    for (int u = std::max(0, static_cast<int>(pixel->x() - r)); u <= std::min(image.cols - 1.0, pixel->x() + r); ++u)
      if (std::hypot(u - pixel->x(), v - pixel->y()) < r) image(v, u) = 240.0f;
}

}  // namespace

double TexturedScene::distance(const Vector3d& p) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const TexturedRectangle& r : rectangles) {
    const Vector3d q = p - r.centre;
    const double s = std::clamp(q.dot(r.half_u.normalized()), -r.half_u.norm(), r.half_u.norm());
    const double t = std::clamp(q.dot(r.half_v.normalized()), -r.half_v.norm(), r.half_v.norm());
    nearest = std::min(nearest, (q - s * r.half_u.normalized() - t * r.half_v.normalized()).norm());
  }
  return nearest;
}

StereoCalibration laboratory_pair(int width, int height) {
  StereoCalibration c;
  c.left = {width, height, 765.4, 762.9, width / 2.0 - 4.3, height / 2.0 - 3.2, -0.3745, 0.1606, 0.00096, -6e-6, 0};
  c.right = {width, height, 776.4, 771.0, width / 2.0 + 8.9, height / 2.0 - 20.1, -0.4073, 0.4307, -0.0029, 0.0049, 0};
  const Transform cMr = make_transform_rpy({0.08827, 0.0006, -0.0009}, {0.004, -0.006, 0.003});
  c.rMc = cMr.inverse();
  return c;
}

CleanPair render(const TexturedScene& scene, const StereoCalibration& calibration, int supersampling) {
  return {image(scene, calibration.left, Transform::Identity(), supersampling),
          image(scene, calibration.right, calibration.rMc.inverse(), supersampling)};
}

std::vector<StereoPair> record(const CleanPair& clean, const StereoCalibration& calibration, int count,
                               const SensorNoise& noise) {
  std::mt19937_64 random(noise.seed);
  std::normal_distribution<float> gaussian;
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<StereoPair> pairs;
  for (int i = 0; i < count; ++i) {
    cv::Mat1f left = clean.left.clone(), right = clean.right.clone();
    for (int k = 0; k < noise.particles; ++k) {
      const double z = 0.55 + 0.1 * uniform(random);
      const Vector3d p(0.4 * z * uniform(random), 0.3 * z * uniform(random), z);
      draw_particle(left, calibration.left, p, 0.006);
      draw_particle(right, calibration.right, calibration.rMc * p, 0.006);
    }
    for (cv::Mat1f* image : {&left, &right})
      for (float& grey : *image) grey += static_cast<float>(255 * noise.sigma) * gaussian(random);
    StereoPair pair;
    left.convertTo(pair.left, CV_8U);
    right.convertTo(pair.right, CV_8U);
    pair.frame = 100 + i;
    pairs.push_back(pair);
  }
  return pairs;
}

TexturedRectangle wall(double depth, double turn_rad) {
  const Vector3d along(std::cos(turn_rad), 0, std::sin(turn_rad));
  return {{0, 0, depth}, 3.0 * along, 3.0 * Vector3d::UnitY()};
}

TexturedScene box_on_floor() {
  // o: top face's centre, z up. The camera looks down at the box's corner.
  const Eigen::Vector3d towards_top = Vector3d(0, -std::sin(0.87), -std::cos(0.87));  // box's up, in c
  Eigen::Matrix3d cRo;
  const Vector3d level = Vector3d::UnitX();
  cRo.col(2) = towards_top;
  cRo.col(0) = std::cos(0.75) * level + std::sin(0.75) * towards_top.cross(level);
  cRo.col(1) = cRo.col(2).cross(cRo.col(0));
  const Vector3d top(0.01, -0.02, 0.95);
  const Vector3d x = cRo.col(0), y = cRo.col(1), z = cRo.col(2);
  TexturedScene scene;
  const double a = 0.07, b = 0.15, h = 0.16;
  scene.rectangles.push_back({top, a * x, b * y});
  for (const double sign : {-1.0, 1.0}) {
    scene.rectangles.push_back({top + sign * a * x - 0.5 * h * z, b * y, 0.5 * h * z});
    scene.rectangles.push_back({top + sign * b * y - 0.5 * h * z, a * x, 0.5 * h * z});
  }
  scene.rectangles.push_back({top - h * z, 3 * x, 3 * y});
  return scene;
}

}  // namespace tankrig::testing
