// Particles that float in the tank: their positions over time, and how a camera sees them.
#pragma once

#include <cstdint>
#include <vector>

#include "core/time.hpp"
#include "sim_backends/world/laser_layer.hpp"

namespace tankrig::sim {

/// A Poisson field that drifts and re-enters on the other side. The same particles for every camera.
class ParticleField {
 public:
  struct Particle {
    Vector3f p;    ///< w at time 0 [m]
    float radius;  ///< [m]
    Vector3f velocity;
  };

  ParticleField(const Scene& scene, std::uint64_t seed);

  std::size_t count() const { return particles_.size(); }
  const Particle& particle(std::size_t i) const { return particles_[i]; }
  Vector3f position(std::size_t i, Stamp when) const;

 private:
  std::vector<Particle> particles_;
  Vector3d low_, size_;
};

/// Particles as discs in one frame, blurred by focus and optics, hidden behind nearer surfaces. The ambient light comes
/// when they are drawn.
class ParticleLayer {
 public:
  ParticleLayer(const ParticleField& field, Stamp when, const CameraView& view, const Radiometry& radiometry,
                const LaserSheet& sheet, const ExposedSheet& exposed, const Rgb& laser_colour,
                const RenderGeometry& geometry);

  struct Disc {
    float u, v, radius, edge, cover;
    std::array<float, 3> value;
  };
  /// Those bright enough to be seen at this ambient light.
  std::vector<Disc> lit(float light) const;

  /// Blends discs into rows [first, first + count) of the image, `rows` starting at row `first`.
  void blend(const std::vector<Disc>& discs, int first, int count, float* rows) const;

 private:
  struct Unlit {
    Disc disc;
    Rgb lamps, transmission, veil;  ///< at light 1
    Rgb laser;
  };
  const CameraView* view_;
  std::vector<Unlit> particles_;
};

}  // namespace tankrig::sim
