#include "bench/metrics/ceiling.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "bench/metrics/line_of_sight.hpp"

namespace tankrig {
namespace {

/// Largest squared tangent of the angle from the optical axis over the image's border, with a margin: beyond it the
/// distortion polynomial may fold points back into the image.
double widest_tangent_squared(const CameraModel& camera) {
  double widest = 0;
  constexpr int kSteps = 32;
  for (int i = 0; i <= kSteps; ++i) {
    const double u = -0.5 + static_cast<double>(camera.width) * i / kSteps;
    const double v = -0.5 + static_cast<double>(camera.height) * i / kSteps;
    for (const Vector2d& n : {camera.normalized(u, -0.5), camera.normalized(u, camera.height - 0.5),
                              camera.normalized(-0.5, v), camera.normalized(camera.width - 0.5, v)})
      widest = std::max(widest, n.squaredNorm());
  }
  return 1.02 * widest;
}

/// A point of the surface ready to be looked at.
struct Patch {
  Vector3d p;
  Vector3d normal;
};

class Views {
 public:
  Views(const TriangleMesh& mesh, const CeilingViews& views)
      : views_(views),
        sight_(meshes(mesh, views)),
        min_cosine_(std::cos(views.max_incidence)),
        lift_(1e-5 * std::max(mesh.bounds().sizes().maxCoeff(), mesh.bounds().center().cwiseAbs().maxCoeff())) {
    const MeshTopology shape = topology(weld(mesh));
    two_sided_ = !shape.closed;
    turn_ = shape.closed && !shape.outward ? -1.0 : 1.0;
    for (const CameraView& view : views.cameras) {
      cMo_.push_back(view.oMc.inverse());
      widest_.push_back(widest_tangent_squared(view.camera));
    }
  }

  bool reachable(const Patch& patch) const {
    for (std::size_t i = 0; i < views_.cameras.size(); ++i)
      if (!seen(patch, i)) return false;
    if (views_.laser.empty()) return true;
    return std::any_of(views_.laser.begin(), views_.laser.end(),
                       [&](const LaserPass& pass) { return swept(patch, pass); });
  }

  Patch patch(const TriangleMesh& mesh, const SurfaceSample& sample) const {
    const Eigen::Vector3i& t = mesh.triangles[sample.triangle];
    const Vector3d& a = mesh.vertices[t[0]];
    return {sample.p, turn_ * (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).normalized()};
  }

 private:
  static std::vector<const TriangleMesh*> meshes(const TriangleMesh& mesh, const CeilingViews& views) {
    std::vector<const TriangleMesh*> all{&mesh};
    for (const TriangleMesh& occluder : views.occluders) all.push_back(&occluder);
    return all;
  }

  /// A straight line from `eye` meets the patch on its face, not too slanted, with nothing in between.
  bool faces(const Patch& patch, const Vector3d& eye) const {
    const Vector3d towards = eye - patch.p;
    double cosine = patch.normal.dot(towards) / towards.norm();
    Vector3d face = patch.normal;
    if (two_sided_ && cosine < 0) {
      cosine = -cosine;
      face = -face;
    }
    if (!(cosine >= min_cosine_ && cosine > 0)) return false;
    const Vector3d start = patch.p + lift_ * face;
    if (views_.ground && (views_.ground->distance(start) < 0 || views_.ground->distance(eye) < 0)) return false;
    return sight_.clear(start, eye);
  }

  bool seen(const Patch& patch, std::size_t camera) const {
    const CameraView& view = views_.cameras[camera];
    const Vector3d p_c = cMo_[camera] * patch.p;
    if (p_c.z() <= 0 || p_c.head<2>().squaredNorm() > widest_[camera] * p_c.z() * p_c.z()) return false;
    const auto pixel = view.camera.project(p_c);
    return pixel && view.camera.contains(*pixel) && faces(patch, view.oMc.translation());
  }

  bool lit(const Patch& patch, const LaserView& view) const {
    const Vector3d along = patch.p - view.origin;
    const Vector3d in_sheet = along - view.sheet.normal.dot(along) * view.sheet.normal;
    const bool in_fan = in_sheet.dot(view.forward) >= std::cos(view.fan_half_angle) * in_sheet.norm();
    return in_fan && faces(patch, view.origin);
  }

  bool swept(const Patch& patch, const LaserPass& pass) const {
    if (pass.size() < 2) return false;
    double before = pass[0].sheet.distance(patch.p);
    for (std::size_t i = 1; i < pass.size(); ++i) {
      const double now = pass[i].sheet.distance(patch.p);
      const double half_step = 0.5 * std::abs(now - before);
      const bool crossed = (before <= 0 && now >= 0) || (before >= 0 && now <= 0);
      const bool at_start = i == 1 && std::abs(before) <= half_step;
      const bool at_end = i + 1 == pass.size() && std::abs(now) <= half_step;
      if (crossed || at_start || at_end) {
        const std::size_t nearer = std::abs(before) <= std::abs(now) ? i - 1 : i;
        if (lit(patch, pass[nearer])) return true;
      }
      before = now;
    }
    return false;
  }

  const CeilingViews& views_;
  LineOfSight sight_;
  double min_cosine_;
  double lift_;  ///< how far rays start above the surface [m]
  bool two_sided_ = false;
  double turn_ = 1;
  std::vector<Transform> cMo_;
  std::vector<double> widest_;
};

}  // namespace

Ceiling surface_ceiling(const TriangleMesh& mesh, const std::vector<SurfaceSample>& samples,
                        const CeilingViews& views) {
  const Views eyes(mesh, views);
  Ceiling ceiling;
  ceiling.max_incidence = views.max_incidence;
  ceiling.reachable.resize(samples.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, samples.size(), 512), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i)
      ceiling.reachable[i] = eyes.reachable(eyes.patch(mesh, samples[i]));
  });

  double whole = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    whole += samples[i].weight;
    ceiling.share += samples[i].weight * ceiling.reachable[i];
  }
  ceiling.share /= whole;
  std::vector<double> residuals(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    residuals[i] = samples[i].weight * (ceiling.reachable[i] - ceiling.share);
  ceiling.sigma = stratified_sigma(residuals);
  return ceiling;
}

}  // namespace tankrig
