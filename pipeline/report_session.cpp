#include "pipeline/report_session.hpp"

#include <fmt/core.h>

#include <limits>

#include "bench/metrics/verdict_cloud.hpp"
#include "bench/report/cloud_picture.hpp"
#include "bench/report/cloud_view.hpp"
#include "bench/report/coverage_picture.hpp"
#include "bench/report/figures.hpp"
#include "bench/report/report_html.hpp"
#include "bench/report/stripe_picture.hpp"
#include "bench/report/web_programs.hpp"
#include "core/atomic_file.hpp"
#include "core/picture_codecs.hpp"
#include "core/text_files.hpp"
#include "session/checking/checksums.hpp"
#include "session/reading/session_summary.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

/// Pictures of one session: each is saved as PNG, brought to the disk with the others before they are sealed, and
/// listed for the report. Those that are ready are not drawn again.
class Album {
 public:
  Album(const Session& session, const Pictures& ready) : folder_(session.path / "pictures"), ready_(ready) {
    fs::create_directories(folder_);
  }

  void begin(const std::string& heading) { heading_ = heading; }
  template <class Draw>
  void add(const std::string& name, const std::string& caption, Draw draw) {
    const fs::path file = folder_ / (name + ".png");
    const auto found = ready_.find(name);
    write_whole_file(file, found != ready_.end() ? found->second : picture_png(draw()));
    pictures_.push_back({heading_, caption, file});
  }
  void keep(const std::string& name, const std::string& caption) {
    const fs::path file = folder_ / (name + ".png");
    if (fs::exists(file)) pictures_.push_back({heading_, caption, file});
  }
  const std::vector<ReportPicture>& pictures() const { return pictures_; }

 private:
  fs::path folder_;
  const Pictures& ready_;
  std::string heading_;
  std::vector<ReportPicture> pictures_;
};

/// The frame of the sweep whose sheet passes nearest to the object's origin; null if no frame has laser and joints.
const FrameRecord* frame_over_object(const Session& session) {
  const FrameRecord* best = nullptr;
  double nearest = std::numeric_limits<double>::infinity();
  for (const FrameRecord& frame : session.frames) {
    if (!frame.laser_on || !frame.q) continue;
    const Plane sheet_b = session.info.calibration.arm->bMe(*frame.q) * *session.info.calibration.ePl;
    const double distance = std::abs(sheet_b.distance(session.info.object->bMo.translation()));
    if (distance < nearest) nearest = distance, best = &frame;
  }
  return best;
}

/// Outside view at the moment the sheet is over the object's origin.
void add_rig_picture(const Session& session, const OutsideView& outside, Album& album) {
  const char* caption = "The rig from outside: arm, projector and sheet, cameras, black box (the paper's Figure 3)";
  if (!outside) return album.keep("rig", caption);
  const FrameRecord* over_object = frame_over_object(session);
  const JointVector q = over_object ? *over_object->q : JointVector::Zero();
  album.add("rig", caption, [&] { return outside(q, over_object != nullptr); });
}

/// `add(name, caption, draw)` for the picture of the stripe over the object.
template <class Add>
void add_stripe_picture(const Session& session, const Score& score, Add add) {
  const FrameRecord* frame = frame_over_object(session);
  if (!frame) return;
  const std::string caption = fmt::format("frame {} of {} with its detected stripe", frame->index, frame->camera);
  add(score.method() + "_frame", caption, [&] {
    std::vector<Vector2d> stripe;
    for (const StripeRow& row : score.reconstruction.rows)
      if (row.frame == frame->index)
        stripe.push_back(score.reconstruction.orientation == StripeOrientation::kRows
                             ? Vector2d(row.peak.position, row.peak.column)
                             : Vector2d(row.peak.column, row.peak.position));
    return draw_stripe_frame(session.image(*frame), stripe);
  });
}

/// `add(name, caption, draw)` for each picture of a method.
template <class Add>
void add_method_pictures(const Session& session, const ObjectSurface& object, const Score& score,
                         const PointCloud& cloud, Add add) {
  if (score.method() == "laser") add_stripe_picture(session, score, add);
  const bool laser = by_laser(score.method());
  const CalibratedCamera& camera = session.camera(laser ? CameraRole::kMono : CameraRole::kLeft);
  const Vector3d camera_o = (session.info.object->bMo.inverse() * camera.bMc).translation();
  for (const bool back : {false, true}) {
    const std::string from = back ? "back" : "camera";
    add(score.method() + "_" + from, "cloud over the object, from the " + from, [&] {
      CloudPictureOptions options;
      options.view = back ? back_view() : view_from(camera_o, object.mesh());
      options.title = score.method();
      return draw_cloud_over_object(cloud, score.metrics.verdicts, object.mesh(), options);
    });
  }
  const double threshold = score.metrics.thresholds.coverage_headline_m;
  add(score.method() + "_coverage", "coverage at " + millimetres(threshold) + " on the unfolded object", [&] {
    return draw_coverage_map(object.mesh(), object.samples(),
                             covered_samples(object.samples(), cloud, score.metrics.verdicts, threshold),
                             score.ceiling.reachable, score.method());
  });
}

/// Every cloud with the cameras, and the arm as it was over the object.
std::string cloud_view(const Session& session, const ObjectSurface& object, const std::vector<Score>& scores) {
  const Transform oMb = session.info.object->bMo.inverse();
  std::vector<ViewedCloud> clouds;
  for (const Score& score : scores)
    clouds.push_back({score.method(), cloud_in_object(session, score.reconstruction), score.metrics.verdicts});
  std::vector<ViewedLines> rig;
  for (const CalibratedCamera& camera : session.info.cameras)
    rig.push_back(camera_pyramid(camera.name, camera.model, oMb * camera.bMc));
  if (const FrameRecord* frame = frame_over_object(session)) {
    ViewedLines arm{"arm", {oMb.translation()}};
    for (const Transform& bMi : session.info.calibration.arm->link_frames(*frame->q))
      arm.points.push_back(oMb * bMi.translation());
    rig.push_back(arm);
  }
  return cloud_view_json(object.mesh(), clouds, rig);
}

}  // namespace

Pictures draw_pictures(const Session& session, const ObjectSurface& object, const Score& score) {
  Pictures pictures;
  add_method_pictures(
      session, object, score, cloud_in_object(session, score.reconstruction),
      [&](const std::string& name, const std::string&, auto draw) { pictures[name] = picture_png(draw()); });
  return pictures;
}

void write_pictures_and_report(const Session& session, const ObjectSurface& object, const std::vector<Score>& scores,
                               const OutsideView& outside, const Pictures& ready) {
  Album album(session, ready);
  add_rig_picture(session, outside, album);
  for (const Score& score : scores) {
    album.begin(score.method());
    const PointCloud cloud = cloud_in_object(session, score.reconstruction);
    write_verdict_cloud(session.path / "clouds" / (score.method() + "_verdict.ply"), cloud, score.metrics);
    add_method_pictures(
        session, object, score, cloud,
        [&](const std::string& name, const std::string& caption, auto draw) { album.add(name, caption, draw); });
  }

  ReportData report;
  if (!cloud_view_program().empty()) report.cloud_view = cloud_view(session, object, scores);
  report.title = "Session " + session.info.name;
  report.facts = session_summary(session);
  for (const Score& score : scores) {
    const std::string m = score.method();
    report.methods.push_back(
        {m,
         score.json,
         {"clouds/" + m + ".ply", "clouds/" + m + ".pcd", "clouds/" + m + "_verdict.ply", "results/" + m + ".json"}});
  }
  report.pictures = album.pictures();
  report.warnings = session.warnings;
  report.command = "tankrig report " + session.path.filename().string();
  write_report_html(session.path / "report.html", report);
}

std::optional<std::vector<Score>> reconstruct_and_report(const Session& session, const PipelineParameters& parameters,
                                                         const std::atomic<bool>& stop,
                                                         const ProgressCallback& progress, const OutsideView& outside,
                                                         ReadyReport ready) {
  const ObjectSurface object = object_of(session, parameters.thresholds);
  std::vector<Score> scores =
      reconstruct_and_score(session, parameters, object, stop, progress, std::move(ready.scores));
  const bool stopped = stop;
  const auto tell = [&](double fraction) {
    if (progress) progress("pictures and report", fraction);
  };
  if (!stopped) {
    tell(0);
    write_pictures_and_report(session, object, scores, outside, ready.pictures);
    tell(1);
  }
  if (session.info.status != "recording") write_checksums(session.path);
  if (stopped) return std::nullopt;
  return scores;
}

}  // namespace tankrig
