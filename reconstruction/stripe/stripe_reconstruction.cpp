#include "reconstruction/stripe/stripe_reconstruction.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <mutex>

#include "core/atomic_file.hpp"
#include "reconstruction/stripe/particle_filter.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kVotingFrames = 7;

void check_size(const cv::Mat& image, const StripeFrame& frame, const CameraModel& camera) {
  if (image.cols != camera.width || image.rows != camera.height)
    throw InputError(fmt::format("frame {}: found an image of {}x{}, expected {}x{} as the camera", frame.index,
                                 image.cols, image.rows, camera.width, camera.height));
}

cv::Mat load_checked(const StripeFrame& frame, const CameraModel& camera) {
  cv::Mat image = frame.load();
  check_size(image, frame, camera);
  return image;
}

struct SetLook {
  StripeLook look;
  double orientation_share = 1;  ///< of the evidence for either orientation, what speaks for the one taken
};

/// The clearest look of frames spread over the sweep, in the orientation that most evidence speaks for. With
/// `parameters` also the share of speckle that suits them.
SetLook common_look(const std::vector<StripeFrame>& frames, const CameraModel& camera, const cv::Mat& background,
                    StripeOrientation orientation, const StripeParameters* parameters) {
  const std::size_t n = std::min(frames.size(), kVotingFrames);
  std::vector<StripeLook> looks(n);
  std::vector<cv::Mat> images(n);
  tbb::parallel_for(std::size_t{0}, n, [&](std::size_t i) {
    const std::size_t k = (2 * i + 1) * frames.size() / (2 * n);
    images[i] = load_checked(frames[k], camera);
    looks[i] = find_look(images[i], background, orientation);
  });
  double columns = 0, rows = 0;
  for (const StripeLook& look : looks) {
    const bool by_rows = look.orientation == StripeOrientation::kRows;
    (by_rows ? rows : columns) += look.evidence;
    (by_rows ? columns : rows) += look.rival;
  }
  SetLook out;
  out.look.orientation = rows > columns ? StripeOrientation::kRows : StripeOrientation::kColumns;
  if (rows + columns > 0) out.orientation_share = std::max(rows, columns) / (rows + columns);
  for (StripeLook& look : looks)
    if (look.orientation == out.look.orientation && look.evidence > out.look.evidence) out.look = std::move(look);
  if (parameters) {
    std::vector<ContrastScatters> scatters(n);
    tbb::parallel_for(std::size_t{0}, n, [&](std::size_t i) {
      scatters[i] = measure_contrasts(images[i], background, *parameters, out.look);
    });
    ContrastScatters all;
    for (const ContrastScatters& s : scatters) all += s;
    out.look.contrast = all.best();
  }
  return out;
}

bool inside(const WorkspaceBox& box, const Vector3d& p) {
  return (p.array() >= box.min.array()).all() && (p.array() <= box.max.array()).all();
}

void drop_particles(std::vector<CloudPoint>& points, const StripeReconstructionParameters& parameters,
                    StripeStatistics& statistics) {
  if (parameters.particle_run <= 0 || !(parameters.particle_radius > 0)) return;
  const std::vector<bool> keep = confirmed_points(points, parameters.particle_radius, parameters.particle_run);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (keep[i]) points[kept++] = points[i];
  statistics.particle = points.size() - kept;
  points.resize(kept);
}

}  // namespace

StripeFrameResult reconstruct_frame(const cv::Mat& image, const StripeFrame& frame, const CameraModel& camera,
                                    const cv::Mat& background, const StripeReconstructionParameters& parameters,
                                    const StripeLook& look) {
  check_size(image, frame, camera);
  StripeFrameResult result;
  if (const auto* ours = std::get_if<StripeParameters>(&parameters.detector))
    result.detection = detect_stripe(image, background, *ours, look);
  else
    result.detection = detect_paper(image, std::get<PaperStripeParameters>(parameters.detector));
  StripeStatistics& statistics = result.detection.statistics;
  triangulate(result.detection, camera, frame.cPl, frame.index, parameters.triangulation, result.points, statistics);
  for (CloudPoint& point : result.points) point.p = frame.aMc * point.p;
  if (parameters.workspace)
    statistics.outside_workspace +=
        std::erase_if(result.points, [&](const CloudPoint& point) { return !inside(*parameters.workspace, point.p); });
  return result;
}

StripeResult reconstruct_stripe(const std::vector<StripeFrame>& frames, const CameraModel& camera,
                                const cv::Mat& background, const StripeReconstructionParameters& parameters,
                                const std::string& cloud_frame,
                                const std::function<void(std::size_t, std::size_t)>& progress) {
  StripeReconstructionParameters settled = parameters;
  StripeOrientation& orientation =
      std::visit([](auto& detector) -> StripeOrientation& { return detector.orientation; }, settled.detector);
  const auto* ours = std::get_if<StripeParameters>(&settled.detector);
  SetLook look;
  if (!frames.empty() && (ours || orientation == StripeOrientation::kAuto)) {
    look = common_look(frames, camera, background, orientation, ours);
    orientation = look.look.orientation;
  }

  std::vector<StripeFrameResult> results(frames.size());
  std::mutex reporting;
  std::size_t done = 0;
  tbb::parallel_for(std::size_t{0}, frames.size(), [&](std::size_t i) {
    results[i] = reconstruct_frame(frames[i].load(), frames[i], camera, background, settled, look.look);
    if (!progress) return;
    const std::lock_guard lock(reporting);
    progress(++done, frames.size());
  });

  StripeResult all;
  all.cloud.frame = cloud_frame;
  if (!results.empty()) all.orientation = results[0].detection.orientation;
  all.orientation_share = look.orientation_share;
  for (std::size_t i = 0; i < results.size(); ++i) {
    const StripeFrameResult& result = results[i];
    all.statistics += result.detection.statistics;
    for (const StripePeak& peak : result.detection.peaks) all.rows.push_back({frames[i].index, peak});
    all.cloud.points.insert(all.cloud.points.end(), result.points.begin(), result.points.end());
  }
  drop_particles(all.cloud.points, parameters, all.statistics);
  all.statistics.points = all.cloud.points.size();
  return all;
}

void write_stripe_csv(const std::filesystem::path& file, const std::vector<StripeRow>& rows,
                      StripeOrientation orientation) {
  std::string text = orientation == StripeOrientation::kRows ? "frame,row_px,column_px,sigma_px,intensity\n"
                                                             : "frame,column_px,row_px,sigma_px,intensity\n";
  for (const StripeRow& row : rows)
    fmt::format_to(std::back_inserter(text), "{},{},{:.4f},{:.4f},{:.4f}\n", row.frame,
                   static_cast<int>(row.peak.column), row.peak.position, row.peak.sigma_px, row.peak.intensity);
  write_file_durably(file, text);
}

}  // namespace tankrig
