// Light in the tank: lamps, downwelling ambient light and the water between.
//
// Units are photometric. Illuminance E [lux] on a Lambertian surface of albedo a leaves as the exitance M = a E [lux];
// everything a camera sees is expressed as the exitance of a white surface that would look as bright.
#pragma once

#include <vector>

#include "sim_backends/world/render_geometry.hpp"

namespace tankrig::sim {

/// All values at light 1, per channel (red, green, blue).
/// Frames: w.
/// Threads: const calls from any.
class Radiometry {
 public:
  Radiometry(const Scene& scene, const RenderGeometry& geometry);

  /// Illuminance from the lamps on a surface element, shadows and attenuation included [lux].
  Rgb direct(const Vector3f& p, const Vector3f& normal) const;

  /// Illuminance from the lamps on an element that faces each of them, no shadows [lux].
  Rgb facing_lamps(const Vector3f& p) const;

  /// Downwelling light that reaches the element past all obstacles, and light reflected about the tank [lux]:
  /// the first reflection along a fixed set of side * side cosine-stratified rays, the rest as in an integrating
  /// sphere.
  Rgb ambient(const Vector3f& p, const Vector3f& normal, int side = 10) const;

  /// Diffuse light on a small body in open water at `p` [lux].
  Rgb open_water(const Vector3f& p) const;

  /// Share of direct light left after `distance` [m].
  Rgb transmission(float distance) const { return (-attenuation_ * distance).exp(); }
  /// Light scattered into a camera ray of this length [lux].
  Rgb veil(float distance) const { return veil_ * (1 - (-backscatter_ * distance).exp()); }
  /// Beam attenuation at the laser's wavelength, taken as the green channel's [1/m].
  float laser_attenuation() const { return attenuation_[1]; }
  /// What a camera sees of the water surface from below [lux].
  Rgb surface_seen_from_below() const { return 0.5f * ambient_; }

 private:
  /// Light from the surface above `p` without obstacles [lux].
  Rgb downwelling(const Vector3f& p) const;
  struct Source {
    Vector3f position, axis;
    Rgb candela;
    float power;  ///< of the cosine of the angle to the axis
  };
  Rgb from_source(const Source& source, float distance, float cos_axis) const;

  const RenderGeometry* geometry_;
  std::vector<Source> sources_;
  Rgb attenuation_, backscatter_, veil_, ambient_;
  Rgb first_reflected_, reflected_;  ///< mean illuminance of light reflected once, and more than once
  float water_depth_;
};

/// Photopic illuminance of the three channels [lux].
inline double photopic(const Rgb& e) { return 0.2126 * e[0] + 0.7152 * e[1] + 0.0722 * e[2]; }

}  // namespace tankrig::sim
