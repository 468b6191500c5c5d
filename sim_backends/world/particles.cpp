// Poisson field, drift, and the discs of its particles.
#include "sim_backends/world/particles.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim_backends/world/hash_noise.hpp"

namespace tankrig::sim {
namespace {

constexpr float kFocus = 0.9f;         ///< distance at which the cameras are sharp [m]
constexpr float kAperture = 0.004f;    ///< diameter of the entrance pupil [m]
constexpr float kNearest = 0.06f;      ///< nearer particles are in the housing [m]
constexpr float kLargestBlur = 14.0f;  ///< [px]
constexpr float kFaintest = 0.2f;      ///< digital numbers at the disc's middle
constexpr float kAlbedo = 0.4f;        ///< of a particle, averaged over its lit and dark sides

/// Poisson variate of the given mean by the normal limit, exact enough for the thousands a tank holds; exact for few.
std::size_t poisson(double mean, std::uint64_t key) {
  if (mean > 200) {
    const double g = GaussianTable::instance()(mix(key));
    return static_cast<std::size_t>(std::max(0.0, std::round(mean + std::sqrt(mean) * g)));
  }
  const double limit = std::exp(-mean);
  double product = 1;
  for (std::size_t n = 0;; ++n)
    if ((product *= unit(mix(key, n))) <= limit) return n;
}

}  // namespace

ParticleField::ParticleField(const Scene& scene, std::uint64_t seed)
    : low_(-scene.tank.size.x() / 2, -scene.tank.size.y() / 2, 0),
      size_(scene.tank.size.x(), scene.tank.size.y(), scene.tank.water_depth) {
  const std::uint64_t key = mix(seed, hash_text("particles"));
  particles_.resize(poisson(scene.water.particles_per_m3 * size_.prod(), key));
  for (std::size_t i = 0; i < particles_.size(); ++i) {
    const auto draw = [&](int k) { return unit(mix(key, 16 * (i + 1) + static_cast<std::uint64_t>(k))); };
    Particle& particle = particles_[i];
    particle.p = (low_ + Vector3d(draw(0), draw(1), draw(2)).cwiseProduct(size_)).cast<float>();
    // Many small, few large: exponential above a third of the mean.
    particle.radius = static_cast<float>(scene.water.particle_radius * (0.35 - 0.65 * std::log(1 - 0.999 * draw(3))));
    const Vector3d own(draw(4) - 0.5, draw(5) - 0.5, draw(6) - 0.5);
    particle.velocity = (scene.water.particle_drift + 0.8 * scene.water.particle_drift.norm() * own).cast<float>();
  }
}

Vector3f ParticleField::position(std::size_t i, Stamp when) const {
  const Particle& particle = particles_[i];
  const double t = static_cast<double>(when.ns) * 1e-9;
  Vector3d p = particle.p.cast<double>() + t * particle.velocity.cast<double>() - low_;
  for (int k = 0; k < 3; ++k) p[k] -= size_[k] * std::floor(p[k] / size_[k]);
  return (p + low_).cast<float>();
}

ParticleLayer::ParticleLayer(const ParticleField& field, Stamp when, const CameraView& view,
                             const Radiometry& radiometry, const LaserSheet& sheet, const ExposedSheet& exposed,
                             const Rgb& laser_colour, const RenderGeometry& geometry)
    : view_(&view) {
  const CameraSpec& spec = view.spec();
  const Eigen::Isometry3f cMw = spec.wMc.inverse().cast<float>();
  const auto focal = static_cast<float>(std::sqrt(spec.model.fx * spec.model.fy));
  const SheetPose& pose = exposed.pose[ExposedSheet::kSamples / 2];
  const float power = exposed.total_power();
  for (std::size_t i = 0; i < field.count(); ++i) {
    const Vector3f p = field.position(i, when), c = cMw * p;
    if (c.z() < kNearest || std::abs(c.x()) > 1.5f * c.z() || std::abs(c.y()) > 1.5f * c.z()) continue;
    const auto pixel = spec.model.project(c.cast<double>());
    if (!pixel || !spec.model.contains(*pixel)) continue;
    const auto u = static_cast<float>(pixel->x()), v = static_cast<float>(pixel->y());
    const float range = c.norm();
    if (range > view.range(static_cast<int>(u + 0.5f), static_cast<int>(v + 0.5f))) continue;
    const CameraView::Sight ray = view.sight(u, v);
    const Vector3f seen = p - ray.origin;
    if (ray.direction.dot(seen) < 0.9999f * seen.norm()) continue;  // beyond the lens model's reach

    const float size_px = field.particle(i).radius * focal / c.z();
    const float defocus_px = 0.5f * kAperture * focal * std::abs(1 / c.z() - 1 / kFocus);
    Disc disc{u, v, 0, 0, 0, {}};
    disc.radius = std::min(std::hypot(size_px, defocus_px), kLargestBlur);
    disc.edge = static_cast<float>(1.5 * spec.psf_sigma_px + 0.3);
    const float r = disc.radius, s = disc.edge, pi = std::numbers::pi_v<float>;
    const float area = r >= s ? pi * (r * r + s * s / 3) : pi * (r + s) * (r + s) * (r + s) / (6 * s);
    disc.cover = std::min(1.0f, pi * size_px * size_px / area);

    Unlit particle{disc, radiometry.facing_lamps(p) + radiometry.open_water(p), radiometry.transmission(range),
                   radiometry.veil(range), Rgb::Zero()};
    const Vector3f way = p - pose.exit;
    const float forward = pose.forward.dot(way), reach = way.norm(), x = pose.distance(p);
    if (power > 0 && forward > kExitClearance && std::abs(x) < 3 * sheet.sigma(reach) &&
        laser_reaches(pose, p, Vector3f::Zero(), geometry, exposed.blockers))
      particle.laser = kAlbedo * power * sheet.illuminance(reach, pose.across.dot(way) / forward, x, 0) *
                       std::exp(-sheet.attenuation() * range) * laser_colour;
    particles_.push_back(particle);
  }
}

std::vector<ParticleLayer::Disc> ParticleLayer::lit(float light) const {
  std::vector<Disc> discs;
  for (const Unlit& particle : particles_) {
    const Rgb exitance =
        kAlbedo * light * particle.lamps * particle.transmission + light * particle.veil + particle.laser;
    if (exitance.maxCoeff() * view_->scale() * particle.disc.cover < kFaintest) continue;
    discs.push_back(particle.disc);
    discs.back().value = view_->response(exitance * view_->scale());
  }
  return discs;
}

void ParticleLayer::blend(const std::vector<Disc>& discs, int first, int count, float* rows) const {
  const int width = view_->width(), channels = view_->channels();
  for (const Disc& disc : discs) {
    const float outer = disc.radius + disc.edge;
    const int top = std::max(first, static_cast<int>(std::ceil(disc.v - outer)));
    const int bottom = std::min(first + count - 1, static_cast<int>(std::floor(disc.v + outer)));
    const int left = std::max(0, static_cast<int>(std::ceil(disc.u - outer)));
    const int right = std::min(width - 1, static_cast<int>(std::floor(disc.u + outer)));
    for (int v = top; v <= bottom; ++v)
      for (int u = left; u <= right; ++u) {
        const float rho = std::hypot(static_cast<float>(u) - disc.u, static_cast<float>(v) - disc.v);
        const float alpha = disc.cover * std::clamp((outer - rho) / (2 * disc.edge), 0.0f, 1.0f);
        float* out = rows + (static_cast<std::size_t>(v - first) * width + u) * channels;
        for (int c = 0; c < channels; ++c) out[c] += alpha * (disc.value[c] - out[c]);
      }
  }
}

}  // namespace tankrig::sim
