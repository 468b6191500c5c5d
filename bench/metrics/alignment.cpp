#include "bench/metrics/alignment.hpp"

#include <nlohmann/json.hpp>

#include "bench/metrics/metrics_json.hpp"
#include "core/angles.hpp"

namespace tankrig {
namespace {

constexpr double kLeastShareOnObject = 0.3;

}  // namespace

PointCloud surface_cloud(const ObjectSurface& object) {
  const TriangleMesh& mesh = object.mesh();
  PointCloud cloud{"o", {}, 0};
  cloud.points.reserve(object.samples().size());
  for (const SurfaceSample& sample : object.samples()) {
    const Eigen::Vector3i& t = mesh.triangles[sample.triangle];
    const Vector3d &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    CloudPoint point;
    point.p = sample.p;
    point.normal = (b - a).cross(c - a).normalized().cast<float>();
    if (point.has_normal()) cloud.points.push_back(point);
  }
  return cloud;
}

AlignedScore evaluate_aligned(const PointCloud& cloud, const ObjectSurface& object, const MetricThresholds& thresholds,
                              const Metrics& unaligned) {
  PointCloud above_ground{cloud.frame, {}, 0};
  for (std::size_t i = 0; i < cloud.points.size(); ++i)
    if (unaligned.verdicts[i] != PointVerdict::kGround && cloud.points[i].p.allFinite()) {
      above_ground.points.push_back(cloud.points[i]);
      above_ground.points.back().normal.setZero();  // which side a stranger's normals are on is not known
    }
  AlignedScore score;
  score.registration = register_cloud(surface_cloud(object), above_ground, Transform::Identity(),
                                      {3 * thresholds.inlier_m, thresholds.inlier_m, 0.003});
  score.doubt = doubt(score.registration, kLeastShareOnObject);
  if (score.doubt.empty())
    score.metrics = evaluate(transformed(score.registration.aMb, above_ground, cloud.frame), object, thresholds);
  return score;
}

nlohmann::json to_json(const Registration& r) {
  nlohmann::json matrix = nlohmann::json::array();
  for (int row = 0; row < 4; ++row) {
    const Eigen::RowVector4d line = r.aMb.matrix().row(row);
    matrix.push_back(std::vector<double>(line.data(), line.data() + 4));
  }
  const Vector3d t = r.aMb.translation();
  return {{"translation_m", {t.x(), t.y(), t.z()}},
          {"rotation_deg", to_degrees(rotation_angle(r.aMb))},
          {"matrix", matrix},
          {"pairs", r.pairs},
          {"share", r.share},
          {"fit", r.fit},
          {"rms_m", r.rms_m},
          {"firmness", r.firmness}};
}

nlohmann::json to_json(const AlignedScore& score) {
  nlohmann::json j = score.metrics ? to_json(*score.metrics) : nlohmann::json{{"refused", score.doubt}};
  j["transform"] = to_json(score.registration);
  return j;
}

}  // namespace tankrig
