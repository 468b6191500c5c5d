// Where a cloud lies on a surface: PCL's point-to-plane ICP, with what it leaves undecided.
#pragma once

#include <string>
#include <vector>

#include "reconstruction/cloud/cloud.hpp"

namespace tankrig {

/// Units: metres.
struct RegistrationSettings {
  double first_reach_m = 0.030;  ///< how far apart partners may be at first; halved until
  double reach_m = 0.010;        ///< this one, which the result is of
  double spacing_m = 0.003;      ///< the moved cloud is thinned to one point for each such cube
};

/// b's cloud on a's surface.
struct Registration {
  Transform aMb = Transform::Identity();
  std::size_t pairs = 0;  ///< points of b, thinned, with a partner
  double share = 0;       ///< of b's thinned points: those no farther than a sixth of the reach from a partner's plane
  double fit = 0;         ///< 1: every one of b's points lies on the surface; 0: none does
  double rms_m = 0;       ///< of the pairs' distances along a's normals
  /// How firmly the pairs hold the freest of the six freedoms: the smallest eigenvalue of the mean of J' J, where J is
  /// a pair's distance by the rotation about the pairs' centre, in units of their mean square radius, and by the
  /// translation. About 0.1 for a box of which three faces are seen; 0 for a plane, a sphere, or a cylinder.
  double firmness = 0;
  int free = 0;  ///< freedoms whose eigenvalue is below kLeastFirmness
};

/// Noise in normals holds what nothing else does with its variance: 0.01 is 6 degrees.
inline constexpr double kLeastFirmness = 0.01;

/// Moves b from `aMb_start` to where its points lie best on a's planes. `a` has normals; where b has them too, partners
/// whose normals are more than 45 degrees apart do not count.
/// Frames: a and b are `surface_a`'s and `cloud_b`'s.
/// Errors: InputError if the surface has no normals.
Registration register_cloud(const PointCloud& surface_a, const PointCloud& cloud_b, const Transform& aMb_start,
                            const RegistrationSettings& settings = {});

/// Why a registration is not to be believed; empty: it is. `least_share` is expected of its share.
std::string doubt(const Registration& registration, double least_share);

/// Angle of a transform's rotation [rad].
double rotation_angle(const Transform& aMb);

}  // namespace tankrig
