// The pictures of a sweep: camera views over light and over noise, and the clouds in the best light.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "apps/tankrig/bench/bench_run.hpp"
#include "bench/report/cloud_picture.hpp"
#include "bench/sweep/strip.hpp"
#include "core/atomic_file.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

constexpr std::size_t kViews = 6;

void write_png(const fs::path& file, const cv::Mat& picture) {
  std::vector<unsigned char> png;
  if (!cv::imencode(".png", picture, png)) throw InputError(file, "cannot be encoded");
  write_whole_file(file, {reinterpret_cast<const char*>(png.data()), png.size()});
}

const Updater* updater_of(const Benchmark& benchmark, UpdaterKind kind) {
  for (const Updater& updater : benchmark.updaters)
    if (updater.kind == kind) return &updater;
  return nullptr;
}

/// At most kViews of its values, first and last among them.
std::vector<double> some_values(const Updater& updater) {
  const std::size_t count = updater.count(), views = std::min(count, kViews);
  std::vector<double> out;
  for (std::size_t i = 0; i < views; ++i) out.push_back(updater.value(views == 1 ? 0 : i * (count - 1) / (views - 1)));
  return out;
}

}  // namespace

std::vector<std::string> BenchRun::write_pictures(const fs::path& folder) {
  std::vector<std::string> names;
  const Updater *lux = updater_of(benchmark_, UpdaterKind::kLux),
                *light = lux ? lux : updater_of(benchmark_, UpdaterKind::kLight),
                *noise = updater_of(benchmark_, UpdaterKind::kNoise);
  const auto scan_now = scan(condition(0));
  fs::create_directories(folder / "figures");
  PictureConditions best;
  const auto set = [&](PictureConditions& at, const Updater* updater, double value) {
    (updater == noise ? at.noise : updater == lux ? at.lux : at.light) = value;
  };
  if (light) set(best, light, light->value(light->count() - 1));
  if (noise) set(best, noise, noise->first);
  // A frame of the sweep, for the stripe is what light and noise hide.
  const Session& session = scan_now->recorded();
  const CalibratedCamera& mono = session.camera(CameraRole::kMono);
  const auto lit = frames_of(session, mono, [](const FrameRecord& f) { return f.laser_on; });
  if (!lit.empty())
    for (const auto& [updater, name] : {std::pair{light, "light"}, {noise, "noise"}}) {
      if (!updater) continue;
      std::vector<std::pair<std::string, cv::Mat>> views;
      for (const double value : some_values(*updater)) {
        PictureConditions at = best;
        set(at, updater, value);
        views.emplace_back(fmt::format("{} {:g}", updater == lux ? "lux" : name, value),
                           scan_now->picture(*lit[lit.size() / 2], at));
      }
      names.push_back(fmt::format("views_{}.png", name));
      write_png(folder / "figures" / names.back(), view_strip(views, 3, 220));
    }
  const Session shot = scan_now->session(best, true, true);
  Session believed = shot;
  for (const CalibrationError& error : condition(0).errors) put_error(error, believed.info);
  for (std::size_t i = 0; i < measured_.size(); ++i) {
    const Measure& measure = benchmark_.measures[i];
    if (!measured_[i] || measure.kind != MeasureKind::kReconstruction3D) continue;
    const std::string method = cloud_of(measure, condition(0));
    const std::string eyes = algorithm(method) ? (uses_laser(method) ? "laser" : "stereo") : method;
    const Score score =
        score_reconstruction(shot, parameters_.thresholds, object_, reconstruct(*scan_now, believed, method),
                             session_ceiling(shot, object_, eyes, parameters_.thresholds));
    const CalibratedCamera& camera = shot.camera(uses_laser(method) ? CameraRole::kMono : CameraRole::kLeft);
    CloudPictureOptions options;
    options.title = method;
    options.width = 560, options.height = 400;
    options.view = view_from((shot.info.object->bMo.inverse() * camera.bMc).translation(), object_.mesh());
    names.push_back(fmt::format("cloud_{}.png", measure.name));
    write_png(folder / "figures" / names.back(),
              draw_cloud_over_object(cloud_in_object(shot, score.reconstruction), score.metrics.verdicts,
                                     object_.mesh(), options));
  }
  return names;
}

}  // namespace tankrig::app
