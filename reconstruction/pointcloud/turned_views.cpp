#include "reconstruction/pointcloud/turned_views.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "core/angles.hpp"
#include "core/input_error.hpp"
#include "reconstruction/pointcloud/cloud_filters.hpp"

namespace tankrig {
namespace {

constexpr int kTurns = 24;
constexpr double kOtherTurn = from_degrees(10);  ///< places that differ by more are two
constexpr double kOtherShift = 0.05;             ///< or by more than this part of the object

Vector3d centre_of(const PointCloud& cloud) {
  Vector3d centre = Vector3d::Zero();
  for (const CloudPoint& point : cloud.points) centre += point.p / static_cast<double>(cloud.points.size());
  return centre;
}

double size_of(const PointCloud& cloud) {
  Eigen::AlignedBox3d box;
  for (const CloudPoint& point : cloud.points) box.extend(point.p);
  return box.diagonal().norm();
}

struct Placed {
  Registration registration;
  std::string doubt;
};

/// Tried at turns all around, coarsely; the best of the different places found are then registered finely.
Placed search(const PointCloud& surface, const PointCloud& cloud, const MergeSettings& settings) {
  const double size = size_of(surface);
  const Vector3d a = centre_of(surface), b = centre_of(cloud);
  const RegistrationSettings coarse{0.16 * size, 0.04 * size, 0.04 * size};
  const PointCloud thin_surface = thinned(surface, 0.015 * size);
  const auto better = [](const Registration& one, const Registration& other) { return one.fit > other.fit; };
  const auto add_if_different = [&](std::vector<Registration>& known, const Registration& r) {
    const bool different = std::ranges::all_of(known, [&](const Registration& other) {
      return rotation_angle(r.aMb.inverse() * other.aMb) > kOtherTurn ||
             (r.aMb * b - other.aMb * b).norm() > kOtherShift * size;
    });
    if (different) known.push_back(r);
  };

  std::vector<Registration> tried;
  for (int turn = 0; turn < kTurns; ++turn) {
    const Eigen::AngleAxisd rotation(2 * std::numbers::pi * turn / kTurns, settings.up.normalized());
    const Transform start = Eigen::Translation3d(a) * rotation * Eigen::Translation3d(-b);
    tried.push_back(register_cloud(thin_surface, cloud, start, coarse));
  }
  std::ranges::stable_sort(tried, better);
  std::vector<Registration> places, fine;
  for (const Registration& candidate : tried) add_if_different(places, candidate);
  constexpr std::size_t kMostPlaces = 4;
  places.resize(std::min(places.size(), kMostPlaces));
  for (const Registration& place : places)
    add_if_different(fine, register_cloud(surface, cloud, place.aMb, settings.registration));
  std::ranges::stable_sort(fine, better);

  Placed best{fine.front(), doubt(fine.front(), settings.least_share)};
  constexpr double kAlike = 0.85;
  if (best.doubt.empty() && fine.size() > 1 && fine[1].fit > kAlike * fine[0].fit) {
    char text[200];
    std::snprintf(
        text, sizeof text,
        "two places fit alike, %.0f degrees apart: %.0f %% and %.0f %% of the points lie on the other surface",
        to_degrees(rotation_angle(fine[0].aMb.inverse() * fine[1].aMb)), 100 * fine[0].share, 100 * fine[1].share);
    best.doubt = text;
  }
  return best;
}

Placed at_its_place(const PointCloud& surface, const PointCloud& cloud, const MergeSettings& settings) {
  const Registration r = register_cloud(surface, cloud, Transform::Identity(), settings.registration);
  return {r, doubt(r, settings.least_share)};
}

}  // namespace

MergedViews merge_views(const PointCloud* surface, const std::vector<TurnedView>& views,
                        const MergeSettings& settings) {
  MergedViews merged;
  for (const TurnedView& view : views) {
    if (!surface && !view.cloud.has_normals())
      throw InputError(view.name + ": not every point has a normal, expected normals");
    const PointCloud& target = surface ? *surface : merged.cloud;
    Placed placed;
    if (target.points.empty()) {
      merged.cloud.frame = view.cloud.frame;
      placed.registration.share = 1;
    } else {
      placed = view.placed ? at_its_place(target, view.cloud, settings) : search(target, view.cloud, settings);
    }
    if (!placed.doubt.empty()) throw InputError(view.name + ": " + placed.doubt);
    if (surface) merged.cloud.frame = surface->frame;
    for (CloudPoint point : transformed(placed.registration.aMb, view.cloud, merged.cloud.frame).points) {
      point.frame = -1;
      merged.cloud.points.push_back(point);
    }
    merged.cloud.invalid += view.cloud.invalid;
    merged.placed.push_back(placed.registration);
  }
  return merged;
}

}  // namespace tankrig
