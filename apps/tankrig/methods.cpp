#include "apps/tankrig/methods.hpp"

#include <algorithm>
#include <chrono>

#include "core/input_error.hpp"
#include "drivers/camera/trigger_pairing.hpp"
#include "reconstruction/cloud/cloud_io.hpp"
#include "rig/scan/session_rig.hpp"

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

std::vector<cv::Mat> images_of(const Session& session, const std::vector<const FrameRecord*>& frames) {
  std::vector<cv::Mat> out;
  for (const FrameRecord* frame : frames) out.push_back(session.image(*frame));
  return out;
}

void reconstruct_laser(const Session& session, const ReconstructionParameters& parameters, Progress& progress,
                       Reconstruction& reconstruction) {
  const SessionCamera& camera = session.camera(CameraRole::kMono);
  const bool scan = session.info.kind == "scan";
  std::vector<StripeFrame> frames;
  for (const FrameRecord* record : frames_of(session, camera, [](const FrameRecord& f) { return f.laser_on; }))
    frames.push_back({[&session, record] { return session.image(*record); }, session.laser_plane(*record),
                      record->index, camera.bMc});
  if (frames.empty()) {
    reconstruction.reason = "no frame with the laser on";
    return;
  }
  StripeReconstructionParameters job;
  if (scan) job.workspace = parameters.workspace;
  cv::Mat background;
  if (reconstruction.method == "laser") {
    job.detector = parameters.laser;
    const std::vector<const FrameRecord*> dark_frames = frames_of(session, camera, dark);
    if (!dark_frames.empty()) background = median_background(images_of(session, dark_frames));
  } else {
    job.detector = parameters.laser_paper;
    job.particle_run = 0;
  }
  StripeResult result = reconstruct_stripe(
      frames, camera.model, background, job, scan ? "b" : "c", [&](std::size_t done, std::size_t total) {
        progress.update("reconstruct: " + reconstruction.method, static_cast<double>(done) / total);
      });
  reconstruction.cloud = std::move(result.cloud);
  reconstruction.rows = std::move(result.rows);
  reconstruction.orientation = result.orientation;
  for (const auto& [reason, count] : counts(result.statistics)) reconstruction.rejections[reason] = count;
  reconstruction.rejected = result.statistics.columns - result.statistics.no_peak - result.statistics.points;
  if (reconstruction.cloud.points.empty())
    reconstruction.reason = "no stripe found in " + std::to_string(frames.size()) + " frames";
}

/// Left and right frames with the laser off. What they show is at rest, so cameras that run free may be half a period
/// of 25 frames/s apart. At most `count` pairs; `single` becomes the number of frames without a partner.
std::vector<StereoPair> stereo_pairs(const Session& session, const SessionCamera& left, const SessionCamera& right,
                                     std::size_t count, std::size_t& single) {
  const auto lefts = frames_of(session, left, dark), rights = frames_of(session, right, dark);
  TriggerPairing<FrameRecord> pairing({.tolerance = std::chrono::milliseconds(20)});
  for (const FrameRecord* l : lefts) pairing.add_left(*l);
  for (const FrameRecord* r : rights) pairing.add_right(*r);
  std::vector<StereoPair> pairs;
  single = lefts.size() + rights.size();
  while (const auto pair = pairing.next()) {
    single -= 2;
    if (pairs.size() < count)
      pairs.push_back({session.image(pair->left), session.image(pair->right), pair->left.index});
  }
  return pairs;
}

void reconstruct_stereo(const Session& session, const ReconstructionParameters& parameters, Progress& progress,
                        Reconstruction& reconstruction) {
  const SessionCamera& left = session.camera(CameraRole::kLeft);
  const SessionCamera& right = session.camera(CameraRole::kRight);
  progress.update("reconstruct: " + reconstruction.method, 0);
  const std::size_t wanted = reconstruction.method == "stereo" ? session.frames.size() : 1;
  std::size_t single = 0;
  const std::vector<StereoPair> pairs = stereo_pairs(session, left, right, wanted, single);
  reconstruction.rejections["single_frames"] = single;
  if (pairs.empty()) {
    reconstruction.reason = "no pair of frames with the laser off";
    return;
  }
  const StereoCalibration calibration{left.model, right.model, right.bMc.inverse() * left.bMc};
  StereoResult result = reconstruction.method == "stereo"
                            ? tankrig::reconstruct(pairs, calibration, parameters.stereo)
                            : reconstruct_paper(pairs.front(), calibration, parameters.stereo_paper);
  reconstruction.cloud.frame = "b";
  std::size_t outside = 0;
  for (CloudPoint point : result.cloud.points) {
    point.p = left.bMc * point.p;
    if (parameters.workspace && !contains(*parameters.workspace, point.p)) {
      ++outside;
      continue;
    }
    reconstruction.cloud.points.push_back(point);
  }
  for (const StereoRejection& r : result.rejected) {
    reconstruction.rejections[r.reason] = r.pixels;
    reconstruction.rejected += r.pixels;
  }
  reconstruction.rejections["outside_workspace"] = outside;
  reconstruction.rejected += outside;
  reconstruction.reason = result.reason;
  progress.update("reconstruct: " + reconstruction.method, 1);
}

}  // namespace

std::vector<const FrameRecord*> frames_of(const Session& session, const SessionCamera& camera,
                                          bool (*wanted)(const FrameRecord&)) {
  std::vector<const FrameRecord*> out;
  for (const FrameRecord& frame : session.frames)
    if (frame.camera == camera.name && wanted(frame)) out.push_back(&frame);
  return out;
}

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
  if (session.info.kind == "import" && !fs::exists(session.path / "rig.yaml")) return {};
  return reconstruction_parameters(session_rig_file(session.path));
}

Reconstruction reconstruct_session(const Session& session, const ReconstructionParameters& parameters,
                                   const std::string& method, Progress& progress) {
  const auto began = std::chrono::steady_clock::now();
  Reconstruction reconstruction;
  reconstruction.method = method;
  reconstruction.rejections = nlohmann::json::object();
  if (by_laser(method))
    reconstruct_laser(session, parameters, progress, reconstruction);
  else
    reconstruct_stereo(session, parameters, progress, reconstruction);
  reconstruction.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return reconstruction;
}

fs::path stripe_file(const Session& session, const std::string& method) {
  return session.path / "clouds" / (method == "laser" ? "stripe.csv" : "stripe_paper.csv");
}

void write_clouds(const Session& session, const Reconstruction& reconstruction) {
  const fs::path clouds = session.path / "clouds";
  fs::create_directories(clouds);
  write_cloud(clouds / (reconstruction.method + ".ply"), reconstruction.cloud);
  write_cloud(clouds / (reconstruction.method + ".pcd"), reconstruction.cloud);
  if (by_laser(reconstruction.method))
    write_stripe_csv(stripe_file(session, reconstruction.method), reconstruction.rows, reconstruction.orientation);
}

}  // namespace tankrig::app
