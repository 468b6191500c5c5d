#include "pipeline/reconstruct_session.hpp"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>

#include "core/input_error.hpp"
#include "core/laser_view.hpp"
#include "core/shown_text.hpp"
#include "core/trigger_pairing.hpp"
#include "reconstruction/cloud/cloud_io.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

void tell(const ProgressCallback& progress, const std::string& stage, double fraction) {
  if (progress) progress(stage, fraction);
}

bool dark(const FrameRecord& frame) { return frame.phase == Phase::kDarkBefore || frame.phase == Phase::kDarkAfter; }

std::vector<cv::Mat> images_of(const Session& session, const std::vector<const FrameRecord*>& frames) {
  std::vector<cv::Mat> out(frames.size());
  tbb::parallel_for(std::size_t{0}, frames.size(), [&](std::size_t i) { out[i] = session.image(*frames[i]); });
  return out;
}

/// Those of an import, which no rig file vouches for.
void check_given_planes(const Session& session, const CameraModel& camera, const std::vector<StripeFrame>& frames) {
  if (session.info.kind != "import") return;
  std::vector<Plane> planes;
  for (const StripeFrame& frame : frames) planes.push_back(frame.cPl);
  if (const std::string wrong = out_of_view(camera, planes); !wrong.empty())
    throw InputError(session.path / "frames.csv", wrong);
}

/// Empty if the paper's gate suits the images.
std::string gate_warning(const PaperStripeParameters& gate, const StripeStatistics& statistics) {
  constexpr double kLeastShare = 0.1;  // of the columns
  const double share = static_cast<double>(statistics.peaks) / static_cast<double>(statistics.columns);
  if (!(share < kLeastShare)) return {};
  return fmt::format(
      "laser_paper: its gate ({}) found a stripe in {:.1f} % of the columns, expected at least {:.0f} %; "
      "does it suit the laser and the camera?",
      gate_in_words(gate), 100 * share, 100 * kLeastShare);
}

/// Empty if the stripe was found and its orientation is clear.
std::string stripe_warning(const StripeResult& result) {
  constexpr double kLeastShare = 0.1, kSureOrientation = 0.6;
  const StripeStatistics& all = result.statistics;
  const bool rows = result.orientation == StripeOrientation::kRows;
  const std::string lines = rows ? "rows" : "columns";
  const auto share = [&](std::uint64_t count) { return static_cast<double>(count) / static_cast<double>(all.columns); };
  if (share(all.peaks) < kLeastShare) {
    const std::pair<std::uint64_t, const char*> reasons[] = {
        {all.no_peak, "show nothing above the noise"},
        {all.low_snr, "show only what is too weak or not in line with its neighbours"},
        {all.ambiguous, "show a second line almost as strong"},
        {all.too_wide, "show a profile wider than the stripe's"},
        {all.skewed, "show a lopsided profile"},
        {all.edge, "lie beside a jump of the stripe"},
        {all.isolated, "belong to pieces too short for a stripe"}};
    const auto& [count, why] = *std::ranges::max_element(reasons);
    return fmt::format("laser: a stripe was found in {:.1f} % of the {}, expected at least {:.0f} %; {:.0f} % {}",
                       100 * share(all.peaks), lines, 100 * kLeastShare, 100 * share(count), why);
  }
  if (result.orientation_share < kSureOrientation)
    return fmt::format(
        "laser: whether the stripe crosses the columns or the rows is not clear: {:.0f} % of the evidence speaks for "
        "the "
        "{}; `reconstruction: laser: orientation:` decides it",
        100 * result.orientation_share, lines);
  return {};
}

void reconstruct_laser(const Session& session, const PipelineParameters& parameters, const ProgressCallback& progress,
                       Reconstruction& reconstruction) {
  const CalibratedCamera& camera = session.camera(CameraRole::kMono);
  const bool scan = session.info.kind == "scan";
  std::vector<StripeFrame> frames;
  for (const FrameRecord* record : frames_of(session, camera, [](const FrameRecord& f) { return f.laser_on; }))
    frames.push_back({[&session, record] { return session.image(*record); }, session.laser_plane(*record),
                      record->index, camera.bMc});
  if (frames.empty()) {
    reconstruction.reason = "no frame with the laser on";
    return;
  }
  check_given_planes(session, camera.model, frames);
  StripeReconstructionParameters job;
  if (scan) job.workspace = parameters.workspace;
  cv::Mat background;
  const std::vector<const FrameRecord*> dark_frames = frames_of(session, camera, dark);
  if (!dark_frames.empty()) background = median_background(images_of(session, dark_frames));
  const bool by_paper = reconstruction.method == "laser_paper";
  if (!by_paper) {
    job.detector = parameters.laser;
  } else {
    job.detector = parameters.laser_paper;
    job.particle_run = 0;
  }
  StripeResult result = reconstruct_stripe(
      frames, camera.model, background, job, scan ? "b" : "c", [&](std::size_t done, std::size_t total) {
        tell(progress, "reconstruct: " + reconstruction.method, static_cast<double>(done) / total);
      });
  reconstruction.cloud = std::move(result.cloud);
  reconstruction.rows = std::move(result.rows);
  reconstruction.orientation = result.orientation;
  for (const auto& [reason, count] : counts(result.statistics)) reconstruction.rejections[reason] = count;
  reconstruction.rejected = result.statistics.columns - result.statistics.no_peak - result.statistics.points;
  reconstruction.orientation_share = result.orientation_share;
  reconstruction.warning = by_paper ? gate_warning(parameters.laser_paper, result.statistics) : stripe_warning(result);
  if (reconstruction.cloud.points.empty())
    reconstruction.reason = fmt::format("no stripe found in {} frames", frames.size());
}

/// Left and right frames with the laser off. What they show is at rest, so cameras that run free may be half a period
/// of 25 frames/s apart. At most `count` pairs; `single` becomes the number of frames without a partner.
std::vector<StereoPair> stereo_pairs(const Session& session, const CalibratedCamera& left,
                                     const CalibratedCamera& right, std::size_t count, std::size_t& single) {
  const auto lefts = frames_of(session, left, dark), rights = frames_of(session, right, dark);
  TriggerPairing<FrameRecord> pairing(std::chrono::milliseconds(20));
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

void reconstruct_stereo(const Session& session, const PipelineParameters& parameters, const ProgressCallback& progress,
                        Reconstruction& reconstruction) {
  const CalibratedCamera& left = session.camera(CameraRole::kLeft);
  const CalibratedCamera& right = session.camera(CameraRole::kRight);
  tell(progress, "reconstruct: " + reconstruction.method, 0);
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
  tell(progress, "reconstruct: " + reconstruction.method, 1);
}

}  // namespace

bool contains(const WorkspaceBox& box, const Vector3d& p) {
  return (p.array() >= box.min.array()).all() && (p.array() <= box.max.array()).all();
}

std::vector<const FrameRecord*> frames_of(const Session& session, const CalibratedCamera& camera,
                                          bool (*wanted)(const FrameRecord&)) {
  std::vector<const FrameRecord*> out;
  for (const FrameRecord& frame : session.frames)
    if (frame.camera == camera.name && wanted(frame)) out.push_back(&frame);
  return out;
}

Reconstruction reconstruct_session(const Session& session, const PipelineParameters& parameters,
                                   const std::string& method, const ProgressCallback& progress) {
  if (std::find(kMethods.begin(), kMethods.end(), method) == kMethods.end())
    throw InputError("method: found '" + shown_text(method) + "', expected laser, laser_paper, stereo or stereo_paper");
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

}  // namespace tankrig
