// Clouds of one object that was turned between them, brought together.
#pragma once

#include <string>
#include <vector>

#include "reconstruction/pointcloud/registration.hpp"

namespace tankrig {

/// One view of the object alone: no floor. With normals on the camera's side, if it is to be registered to other views.
struct TurnedView {
  std::string name;  ///< for messages
  PointCloud cloud;
  bool placed = false;  ///< its frame is nearly the surface's: there is no turn to look for
};

struct MergeSettings {
  Vector3d up = Vector3d::UnitZ();  ///< what the object was turned about, nearly; in every view's frame
  double least_share = 0.3;         ///< of a view's points must lie on the other surface
  RegistrationSettings registration{.first_reach_m = 0.024, .reach_m = 0.006, .spacing_m = 0.005};
};

struct MergedViews {
  PointCloud cloud;                  ///< in the surface's frame; points are of no one `frame` any more
  std::vector<Registration> placed;  ///< one per view
};

/// With a `surface` (the object's own, with normals): each view is registered to it, and its frame is the result's.
/// Without: each view after the first is registered to those before it, and the first's frame is the result's. A view
/// that is not placed is tried at turns all around `up`.
/// Errors: InputError naming the view if its registration is in doubt: too little overlap, a shape that slides or turns
/// on itself, or two places that fit alike.
MergedViews merge_views(const PointCloud* surface, const std::vector<TurnedView>& views, const MergeSettings& settings);

}  // namespace tankrig
