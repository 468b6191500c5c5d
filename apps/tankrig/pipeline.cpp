#include "apps/tankrig/pipeline.hpp"

#include <algorithm>
#include <chrono>
#include <fstream>

#include "bench/metrics/metrics_json.hpp"
#include "core/input_error.hpp"
#include "reconstruction/cloud/cloud_io.hpp"
#include "rig/session/text_files.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

/// Reads one sub-section of `reconstruction` with its own reader.
template <class Parameters, class Reader>
void read_section(const std::optional<ConfigNode>& reconstruction, const char* name, Parameters& out, Reader reader) {
  if (!reconstruction) return;
  if (const auto node = reconstruction->optional_child(name)) out = reader(*node);
}

bool contains(const WorkspaceBox& box, const Vector3d& p) {
  return (p.array() >= box.min.array()).all() && (p.array() <= box.max.array()).all();
}

WorkspaceBox workspace_from(const ConfigNode& node) {
  const std::vector<double> low = node.numbers("min_m", 3), high = node.numbers("max_m", 3);
  const WorkspaceBox box{{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
  if (!(box.min.array() < box.max.array()).all()) node.fail("max_m", "expected every number above its one in min_m");
  return box;
}

bool dark(const FrameRecord& frame) { return frame.phase == Phase::kDarkBefore || frame.phase == Phase::kDarkAfter; }

std::vector<const FrameRecord*> frames_of(const Session& session, const SessionCamera& camera,
                                          bool (*wanted)(const FrameRecord&)) {
  std::vector<const FrameRecord*> out;
  for (const FrameRecord& frame : session.frames)
    if (frame.camera == camera.name && wanted(frame)) out.push_back(&frame);
  return out;
}

std::vector<cv::Mat> images_of(const Session& session, const std::vector<const FrameRecord*>& frames) {
  std::vector<cv::Mat> out;
  for (const FrameRecord* frame : frames) out.push_back(session.image(*frame));
  return out;
}

void reconstruct_laser(const Session& session, const ReconstructionParameters& parameters, Progress& progress,
                       MethodOutcome& outcome) {
  const SessionCamera& camera = session.camera(CameraRole::kMono);
  const bool scan = session.info.kind == "scan";
  std::vector<StripeFrame> frames;
  for (const FrameRecord* record : frames_of(session, camera, [](const FrameRecord& f) { return f.laser_on; }))
    frames.push_back({[&session, record] { return session.image(*record); }, session.laser_plane(*record),
                      record->index, camera.bMc});
  if (frames.empty()) {
    outcome.reason = "no frame with the laser on";
    return;
  }
  StripeReconstructionParameters job;
  if (scan) job.workspace = parameters.workspace;
  cv::Mat background;
  if (outcome.method == "laser") {
    job.detector = parameters.laser;
    const std::vector<const FrameRecord*> dark_frames = frames_of(session, camera, dark);
    if (!dark_frames.empty()) background = median_background(images_of(session, dark_frames));
  } else {
    job.detector = parameters.laser_paper;
    job.particle_run = 0;
  }
  StripeResult result = reconstruct_stripe(
      frames, camera.model, background, job, scan ? "b" : "c", [&](std::size_t done, std::size_t total) {
        progress.update("reconstruct: " + outcome.method, static_cast<double>(done) / total);
      });
  outcome.cloud = std::move(result.cloud);
  outcome.rows = std::move(result.rows);
  outcome.orientation = result.orientation;
  for (const auto& [reason, count] : counts(result.statistics)) outcome.rejections[reason] = count;
  outcome.rejected = result.statistics.columns - result.statistics.no_peak - result.statistics.points;
  if (outcome.cloud.points.empty()) outcome.reason = "no stripe found in " + std::to_string(frames.size()) + " frames";
}

/// Left and right frames of one instant: stamps no farther apart than a tenth of a millisecond.
std::vector<StereoPair> stereo_pairs(const Session& session, const SessionCamera& left, const SessionCamera& right) {
  std::vector<StereoPair> pairs;
  const auto rights = frames_of(session, right, dark);
  for (const FrameRecord* l : frames_of(session, left, dark))
    for (const FrameRecord* r : rights)
      if (std::chrono::abs(l->stamp - r->stamp) <= std::chrono::microseconds(100)) {
        pairs.push_back({session.image(*l), session.image(*r), l->index});
        break;
      }
  return pairs;
}

void reconstruct_stereo(const Session& session, const ReconstructionParameters& parameters, Progress& progress,
                        MethodOutcome& outcome) {
  const SessionCamera& left = session.camera(CameraRole::kLeft);
  const SessionCamera& right = session.camera(CameraRole::kRight);
  progress.update("reconstruct: " + outcome.method, 0);
  const std::vector<StereoPair> pairs = stereo_pairs(session, left, right);
  if (pairs.empty()) {
    outcome.reason = "no pair of frames with the laser off";
    return;
  }
  const StereoCalibration calibration{left.model, right.model, right.bMc.inverse() * left.bMc};
  StereoResult result = outcome.method == "stereo"
                            ? tankrig::reconstruct(pairs, calibration, parameters.stereo)
                            : reconstruct_paper(pairs.front(), calibration, parameters.stereo_paper);
  outcome.cloud.frame = "b";
  std::size_t outside = 0;
  for (CloudPoint point : result.cloud.points) {
    point.p = left.bMc * point.p;
    if (parameters.workspace && !contains(*parameters.workspace, point.p)) {
      ++outside;
      continue;
    }
    outcome.cloud.points.push_back(point);
  }
  for (const StereoRejection& r : result.rejected) {
    outcome.rejections[r.reason] = r.pixels;
    outcome.rejected += r.pixels;
  }
  outcome.rejections["outside_workspace"] = outside;
  outcome.rejected += outside;
  outcome.reason = result.reason;
  progress.update("reconstruct: " + outcome.method, 1);
}

std::vector<LaserPass> laser_passes(const Session& session, const SessionCamera& camera, const Transform& oMb) {
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

Ceiling ceiling_of(const Session& session, const ObjectSurface& object, const std::string& method,
                   const MetricThresholds& thresholds) {
  const Transform oMb = session.info.object->bMo.inverse();
  CeilingViews views;
  views.max_incidence = thresholds.max_incidence;
  if (method.starts_with("laser")) {
    const SessionCamera& camera = session.camera(CameraRole::kMono);
    views.cameras.push_back({camera.model, oMb * camera.bMc});
    views.laser = laser_passes(session, camera, oMb);
    if (views.laser.empty()) views.laser.emplace_back();  // no light at all: nothing is reachable
  } else {
    for (CameraRole role : {CameraRole::kLeft, CameraRole::kRight})
      views.cameras.push_back({session.camera(role).model, oMb * session.camera(role).bMc});
  }
  return surface_ceiling(object.mesh(), object.samples(), views);
}

void score_outcome(const Session& session, const ReconstructionParameters& parameters, const ObjectSurface& object,
                   MethodOutcome& outcome) {
  const PointCloud cloud = cloud_in_object(session, outcome);
  outcome.ceiling = ceiling_of(session, object, outcome.method, parameters.thresholds);
  outcome.metrics = tankrig::evaluate(cloud, object, parameters.thresholds, &*outcome.ceiling);
  outcome.score = to_json(*outcome.metrics);
  outcome.score["reconstruction_rejected"] = outcome.rejected;
  outcome.score["reconstruction_rejected_by_reason"] = outcome.rejections;
  if (!outcome.reason.empty()) outcome.score["reason"] = outcome.reason;
}

}  // namespace

ReconstructionParameters reconstruction_parameters(const ConfigNode& rig_file) {
  ReconstructionParameters out;
  const auto reconstruction = rig_file.optional_child("reconstruction");
  read_section(reconstruction, "laser", out.laser, stripe_parameters_from);
  read_section(reconstruction, "laser_paper", out.laser_paper, paper_stripe_parameters_from);
  read_section(reconstruction, "stereo", out.stereo, stereo_parameters_from);
  read_section(reconstruction, "stereo_paper", out.stereo_paper, paper_stereo_parameters_from);
  if (reconstruction) reconstruction->finish();
  if (const auto node = rig_file.optional_child("workspace")) {
    out.workspace = workspace_from(*node);
    node->finish();
  }
  if (const auto node = rig_file.optional_child("evaluation")) {
    out.thresholds = metric_thresholds_from(*node);
    node->finish();
  }
  return out;
}

ReconstructionParameters reconstruction_parameters(const Session& session) {
  const fs::path rig_file = session.path / "rig.yaml";
  if (!fs::exists(rig_file)) return {};
  return reconstruction_parameters(ConfigNode::load(rig_file));
}

MethodOutcome reconstruct_session(const Session& session, const ReconstructionParameters& parameters,
                                  const std::string& method, Progress& progress) {
  const auto began = std::chrono::steady_clock::now();
  MethodOutcome outcome;
  outcome.method = method;
  outcome.rejections = nlohmann::json::object();
  if (method.starts_with("laser"))
    reconstruct_laser(session, parameters, progress, outcome);
  else
    reconstruct_stereo(session, parameters, progress, outcome);
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return outcome;
}

void write_clouds(const Session& session, const MethodOutcome& outcome) {
  const fs::path clouds = session.path / "clouds";
  fs::create_directories(clouds);
  write_cloud(clouds / (outcome.method + ".ply"), outcome.cloud);
  write_cloud(clouds / (outcome.method + ".pcd"), outcome.cloud);
  if (outcome.method.starts_with("laser"))
    write_stripe_csv(clouds / (outcome.method + "_stripe.csv"), outcome.rows, outcome.orientation);
}

ObjectSurface object_of(const Session& session, const MetricThresholds& thresholds) {
  if (!session.info.object) throw InputError(session.path, "has no object to score against, expected a scan");
  return ObjectSurface(read_mesh(session.path / session.info.object->mesh), thresholds.surface_samples);
}

PointCloud cloud_in_object(const Session& session, const MethodOutcome& outcome) {
  const Transform oMb = session.info.object->bMo.inverse();
  PointCloud cloud = outcome.cloud;
  cloud.frame = "o";
  for (CloudPoint& point : cloud.points) point.p = oMb * point.p;
  return cloud;
}

std::vector<MethodOutcome> reconstruct_and_score(const Session& session, const ReconstructionParameters& parameters,
                                                 const ObjectSurface& object, Progress& progress) {
  std::vector<MethodOutcome> outcomes;
  fs::create_directories(session.path / "results");
  for (const std::string& method : kMethods) {
    const bool laser = method.starts_with("laser");
    if (laser ? !session.find_camera(CameraRole::kMono) : !session.find_camera(CameraRole::kLeft)) continue;
    MethodOutcome outcome = reconstruct_session(session, parameters, method, progress);
    write_clouds(session, outcome);
    score_outcome(session, parameters, object, outcome);
    write_whole_file(session.path / "results" / (method + ".json"), outcome.score.dump(2) + "\n");
    outcomes.push_back(std::move(outcome));
  }
  return outcomes;
}

}  // namespace tankrig::app
