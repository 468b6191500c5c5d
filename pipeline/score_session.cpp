#include "pipeline/score_session.hpp"

#include <algorithm>

#include "bench/metrics/metrics_json.hpp"
#include "core/input_error.hpp"
#include "core/text_files.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

std::vector<LaserPass> laser_passes(const Session& session, const CalibratedCamera& camera, const Transform& oMb) {
  const SessionCalibration& c = session.info.calibration;
  std::vector<LaserPass> passes;
  int pass = -1;
  for (const FrameRecord* frame :
       frames_of(session, camera, [](const FrameRecord& f) { return f.laser_on && f.q.has_value(); })) {
    if (frame->pass != pass) passes.emplace_back();
    pass = frame->pass;
    const Transform oMe = oMb * c.arm->bMe(*frame->q);
    passes.back().push_back(
        {oMe * *c.ePl, oMe * c.laser_origin_e, oMe.linear() * c.laser_direction_e, c.laser_fan / 2});
  }
  return passes;
}

}  // namespace

bool has_cameras(const Session& session, const std::string& method) {
  if (by_laser(method)) return session.find_camera(CameraRole::kMono);
  return session.find_camera(CameraRole::kLeft) && session.find_camera(CameraRole::kRight);
}

ObjectSurface object_of(const Session& session, const MetricThresholds& thresholds) {
  if (!session.info.object) throw InputError(session.path, "has no object to score against, expected a scan");
  return ObjectSurface(read_mesh(session.path / session.info.object->mesh, session.path), thresholds.surface_samples);
}

PointCloud cloud_in_object(const Session& session, const Reconstruction& reconstruction) {
  return transformed(session.info.object->bMo.inverse(), reconstruction.cloud, "o");
}

Ceiling session_ceiling(const Session& session, const ObjectSurface& object, const std::string& method,
                        const MetricThresholds& thresholds) {
  const Transform oMb = session.info.object->bMo.inverse();
  CeilingViews views;
  views.max_incidence = thresholds.max_incidence;
  if (by_laser(method)) {
    const CalibratedCamera& camera = session.camera(CameraRole::kMono);
    views.cameras.push_back({camera.model, oMb * camera.bMc});
    views.laser = laser_passes(session, camera, oMb);
    if (views.laser.empty()) views.laser.emplace_back();  // no light at all: nothing is reachable
  } else {
    for (CameraRole role : {CameraRole::kLeft, CameraRole::kRight})
      views.cameras.push_back({session.camera(role).model, oMb * session.camera(role).bMc});
  }
  return surface_ceiling(object.mesh(), object.samples(), views);
}

Score score_reconstruction(const Session& session, const MetricThresholds& thresholds, const ObjectSurface& object,
                           Reconstruction reconstruction) {
  Ceiling ceiling = session_ceiling(session, object, reconstruction.method, thresholds);
  return score_reconstruction(session, thresholds, object, std::move(reconstruction), std::move(ceiling));
}

Score score_reconstruction(const Session& session, const MetricThresholds& thresholds, const ObjectSurface& object,
                           Reconstruction reconstruction, Ceiling ceiling) {
  Score score;
  score.ceiling = std::move(ceiling);
  score.metrics = tankrig::evaluate(cloud_in_object(session, reconstruction), object, thresholds, &score.ceiling);
  score.json = to_json(score.metrics);
  score.json["reconstruction_rejected"] = reconstruction.rejected;
  score.json["reconstruction_rejected_by_reason"] = reconstruction.rejections;
  if (!reconstruction.reason.empty()) score.json["reason"] = reconstruction.reason;
  if (!reconstruction.warning.empty()) score.json["warning"] = reconstruction.warning;
  score.reconstruction = std::move(reconstruction);
  return score;
}

std::vector<Score> reconstruct_and_score(const Session& session, const PipelineParameters& parameters,
                                         const ObjectSurface& object, const std::atomic<bool>& stop,
                                         const ProgressCallback& progress, std::vector<Score> ready) {
  std::vector<Score> scores;
  fs::create_directories(session.path / "results");
  for (const std::string& method : kMethods) {
    if (stop) break;
    if (!has_cameras(session, method)) continue;
    const auto made = std::ranges::find(ready, method, &Score::method);
    scores.push_back(made != ready.end()
                         ? std::move(*made)
                         : score_reconstruction(session, parameters.thresholds, object,
                                                reconstruct_session(session, parameters, method, progress)));
    write_clouds(session, scores.back().reconstruction);
    write_whole_file(session.path / "results" / (method + ".json"), scores.back().json.dump(2) + "\n");
  }
  return scores;
}

nlohmann::ordered_json scores_json(const std::vector<Score>& scores) {
  nlohmann::ordered_json out;
  for (const Score& score : scores) out[score.method()] = score.json;
  return out;
}

std::vector<std::pair<std::string, nlohmann::json>> tabled(const std::vector<Score>& scores) {
  std::vector<std::pair<std::string, nlohmann::json>> out;
  for (const Score& score : scores) out.emplace_back(score.method(), score.json);
  return out;
}

}  // namespace tankrig
