// The ceiling: the part of the object's surface that a scan could have seen at all.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "bench/metrics/surface_samples.hpp"
#include "core/angles.hpp"
#include "core/camera_model.hpp"

namespace tankrig {

/// A camera that must see the surface.
struct CameraView {
  CameraModel camera;
  Transform oMc = Transform::Identity();
};

/// The laser sheet while one frame was exposed.
/// Frames: o. The light leaves `origin` within `fan_half_angle` [rad] of `forward`, a unit vector in the sheet.
struct LaserView {
  Plane sheet;
  Vector3d origin = Vector3d::Zero();
  Vector3d forward = Vector3d::UnitZ();
  double fan_half_angle = 0;
};

/// Frames of one sweep in order, laser on. The sheet is taken to sweep the surface between one frame and the next, and
/// half a step beyond the first and the last; a pass of one frame lights nothing.
using LaserPass = std::vector<LaserView>;

/// A sample belongs to the ceiling when every camera sees it (inside the image, at no more than `max_incidence`,
/// nothing in between) and, if there are laser passes, the sheet passes over it in one of them (within the fan, at no
/// more than `max_incidence`, nothing in between). A closed mesh is seen from outside only, an open one from both
/// sides.
struct CeilingViews {
  std::vector<CameraView> cameras;          ///< one, or both eyes of the stereo pair
  std::vector<LaserPass> laser;             ///< empty: no light of our own is needed
  std::vector<TriangleMesh> occluders;      ///< anything else that casts shadows; frame o
  std::optional<Plane> ground;              ///< solid, its normal points into the water; frame o
  double max_incidence = from_degrees(75);  ///< from the surface normal [rad]
};

struct Ceiling {
  std::vector<std::uint8_t> reachable;  ///< one per surface sample, 0 or 1
  double share = 0;                     ///< of the whole surface, 0..1
  double sigma = 0;                     ///< sampling error of `share`, one standard deviation
  double max_incidence = 0;             ///< as asked for [rad]
};

/// `samples` are `mesh`'s own. Parallel; the same bits for any number of threads.
Ceiling surface_ceiling(const TriangleMesh& mesh, const std::vector<SurfaceSample>& samples, const CeilingViews& views);

}  // namespace tankrig
