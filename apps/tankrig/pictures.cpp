#include "apps/tankrig/pictures.hpp"

#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "bench/metrics/verdict_cloud.hpp"
#include "bench/report/cloud_picture.hpp"
#include "bench/report/coverage_picture.hpp"
#include "bench/report/figures.hpp"
#include "bench/report/report_html.hpp"
#include "bench/report/stripe_picture.hpp"
#include "core/input_error.hpp"
#include "rig/session/session_summary.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

/// Pictures of one session: each is saved as PNG and listed for the report.
class Album {
 public:
  explicit Album(const Session& session) : session_(session), folder_(session.path / "pictures") {
    fs::create_directories(folder_);
  }

  void add(const std::string& name, const std::string& caption, const cv::Mat& image) {
    const fs::path file = folder_ / (name + ".png");
    if (!cv::imwrite(file.string(), image)) throw InputError(file, "cannot be written");
    pictures_.push_back({caption, image, file});
  }
  void keep(const std::string& name, const std::string& caption) {
    const fs::path file = folder_ / (name + ".png");
    if (fs::exists(file)) pictures_.push_back({caption, {}, file});
  }
  const std::vector<ReportPicture>& pictures() const { return pictures_; }

 private:
  const Session& session_;
  fs::path folder_;
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
void add_rig_picture(const Session& session, const sim::TankWorld* world, Album& album) {
  const char* caption = "The rig from outside: arm, projector and sheet, cameras, black box (the paper's Figure 3)";
  if (!world) return album.keep("rig", caption);
  const FrameRecord* over_object = frame_over_object(session);
  const JointVector q = over_object ? *over_object->q : JointVector::Zero();
  album.add("rig", caption, world->render_external(q, over_object != nullptr, 1280, 860));
}

void add_stripe_picture(const Session& session, const MethodOutcome& outcome, Album& album) {
  const FrameRecord* frame = frame_over_object(session);
  if (!frame) return;
  std::vector<Vector2d> stripe;
  for (const StripeRow& row : outcome.rows)
    if (row.frame == frame->index)
      stripe.push_back(outcome.orientation == StripeOrientation::kRows ? Vector2d(row.peak.position, row.peak.column)
                                                                       : Vector2d(row.peak.column, row.peak.position));
  album.add(
      outcome.method + "_frame",
      outcome.method + ": frame " + std::to_string(frame->index) + " of " + frame->camera + " with its detected stripe",
      draw_stripe_frame(session.image(*frame), stripe));
}

void add_method_pictures(const Session& session, const ObjectSurface& object, const MethodOutcome& outcome,
                         Album& album) {
  const PointCloud cloud = cloud_in_object(session, outcome);
  write_verdict_cloud(session.path / "clouds" / (outcome.method + "_verdict.ply"), cloud, outcome.metrics->verdicts);
  for (const auto& [name, view] : {std::pair{"front", front_view()}, std::pair{"back", back_view()}}) {
    CloudPictureOptions options;
    options.view = view;
    options.title = outcome.method;
    album.add(outcome.method + "_" + name, outcome.method + ": cloud over the object, from the " + name,
              draw_cloud_over_object(cloud, outcome.metrics->verdicts, object.mesh(), options));
  }
  const double threshold = outcome.metrics->thresholds.coverage_headline_m;
  album.add(outcome.method + "_coverage",
            outcome.method + ": coverage at " + millimetres(threshold) + " on the unfolded object",
            draw_coverage_map(object.mesh(), object.samples(),
                              covered_samples(object.samples(), cloud, outcome.metrics->verdicts, threshold),
                              outcome.ceiling->reachable, outcome.method));
}

}  // namespace

void write_pictures_and_report(const Session& session, const ObjectSurface& object,
                               const std::vector<MethodOutcome>& outcomes, const sim::TankWorld* world) {
  Album album(session);
  add_rig_picture(session, world, album);
  for (const MethodOutcome& outcome : outcomes)
    if (outcome.method == "laser") add_stripe_picture(session, outcome, album);
  for (const MethodOutcome& outcome : outcomes) add_method_pictures(session, object, outcome, album);

  ReportData report;
  report.title = "Session " + session.info.name;
  report.facts = session_summary(session);
  for (const MethodOutcome& outcome : outcomes) report.methods.push_back({outcome.method, outcome.score});
  report.pictures = album.pictures();
  report.warnings = session.warnings;
  report.command = "tankrig report " + session.path.filename().string();
  write_report_html(session.path / "report.html", report);
}

}  // namespace tankrig::app
