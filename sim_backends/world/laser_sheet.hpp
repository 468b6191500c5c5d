// The light of the line projector: a sheet with a fan profile, a Gaussian section and the water's attenuation.
#pragma once

#include <span>

#include "sim_backends/world/arm_body.hpp"

namespace tankrig::sim {

/// The projector at one instant.
/// Frames: w.
struct SheetPose {
  Vector3f exit = Vector3f::Zero();
  Vector3f normal = Vector3f::UnitX();   ///< x_l: across the sheet
  Vector3f across = Vector3f::UnitY();   ///< y_l: in the sheet, across the beam
  Vector3f forward = Vector3f::UnitZ();  ///< z_l: the middle of the fan

  SheetPose() = default;
  explicit SheetPose(const Transform& wMl);
  float distance(const Vector3f& p) const { return normal.dot(p - exit); }
};

/// Photometry of the sheet.  Source of the section: Gaussian beam far from its waist, 1/e^2 half-width h(r) = h0 +
/// divergence r.
class LaserSheet {
 public:
  LaserSheet(const LaserLine& line, float attenuation);

  /// Light per metre along the line, on a surface facing the beam at range r [m] and tan of the fan angle [lm/m].
  float line_density(float range, float tan_angle) const;

  /// Illuminance on a surface facing the beam at the signed distance `x` from the sheet [lux].
  /// `extra_variance` [m^2] widens the section at constant flux: the sheet averaged over a small patch.
  float illuminance(float range, float tan_angle, float x, float extra_variance) const;

  /// Standard deviation of the section [m]: half of the 1/e^2 half-width.
  float sigma(float range) const { return 0.5f * (half_width_ + divergence_ * range); }
  float attenuation() const { return attenuation_; }

 private:
  float half_width_, divergence_, attenuation_;
  float lumen_per_rad_, tan_flat_, tan_edge_, flat_, edge_;
};

/// Whether the laser's way from its exit to `p` (its illuminated side towards `normal`) is free of tank, objects and
/// arm.
/// Rays start kExitClearance beyond the exit: the projector does not shade itself.
bool laser_reaches(const SheetPose& pose, const Vector3f& p, const Vector3f& normal, const RenderGeometry& geometry,
                   const std::vector<Capsule>& blockers);
inline constexpr float kExitClearance = 0.03f;

/// Those of the arm's bodies that come near the sheet in front of the exit.
std::vector<Capsule> bodies_in_sheet(const std::vector<Capsule>& bodies, const SheetPose& pose);

}  // namespace tankrig::sim
