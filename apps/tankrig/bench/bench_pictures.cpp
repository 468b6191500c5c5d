// The pictures of a sweep: camera views over light, over noise and over fog, and the clouds in the best light.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/tankrig/bench/bench_run.hpp"
#include "bench/report/cloud_picture.hpp"
#include "bench/report/cloud_view.hpp"
#include "bench/sweep/strip.hpp"
#include "bench/sweep/sweep_report.hpp"
#include "core/atomic_file.hpp"
#include "core/picture_codecs.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

constexpr std::size_t kViews = 6;

void write_png(const fs::path& file, const cv::Mat& picture) { write_whole_file(file, picture_png(picture)); }

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
  const Updater *lux = updater_of(benchmark(), UpdaterKind::kLux),
                *light = lux ? lux : updater_of(benchmark(), UpdaterKind::kLight),
                *noise = updater_of(benchmark(), UpdaterKind::kNoise),
                *fog = updater_of(benchmark(), UpdaterKind::kBagFog);
  const auto scan_now = scan(condition(0));
  fs::create_directories(folder / "figures");
  PictureConditions best;
  const auto set = [&](PictureConditions& at, const Updater* updater, double value) {
    if (updater == fog)
      at.fog = {value, fog->image_depth_m};
    else
      (updater == noise ? at.noise : updater == lux ? at.lux : at.light) = value;
  };
  if (light) set(best, light, light->highest());
  if (noise) set(best, noise, noise->first);
  // A frame of the sweep, for the stripe is what light and noise hide.
  const Session& session = scan_now->recorded();
  const CalibratedCamera& mono = session.camera(CameraRole::kMono);
  const auto lit = frames_of(session, mono, [](const FrameRecord& f) { return f.laser_on; });
  if (!lit.empty())
    for (const auto& [updater, name, file] :
         {std::tuple{light, "light", kViewsLight}, std::tuple{noise, "noise", kViewsNoise},
          std::tuple{fog, "fog", kViewsFog}}) {
      if (!updater) continue;
      std::vector<std::pair<std::string, cv::Mat>> views;
      for (const double value : some_values(*updater)) {
        PictureConditions at = best;
        set(at, updater, value);
        views.emplace_back(fmt::format("{} {:g}", updater == lux ? "lux" : name, value),
                           scan_now->picture(*lit[lit.size() / 2], at));
      }
      names.push_back(file);
      write_png(folder / "figures" / names.back(), view_strip(views, 3, 220));
    }
  const Session shot = scan_now->session(best, true, true);
  Session believed = shot;
  for (const CalibrationError& error : condition(0).errors) put_error(error, believed.info);
  const Transform oMb = shot.info.object->bMo.inverse();
  std::vector<ViewedCloud> viewed;
  for (std::size_t i = 0; i < benchmark().measures.size(); ++i) {
    const std::string cloud = evaluation_.measured_cloud(i, condition(0));
    if (cloud.empty()) continue;
    const Score score = evaluation_.score(*scan_now, shot, believed, cloud);
    const CalibratedCamera& camera = shot.camera(evaluation_.uses_laser(cloud) ? CameraRole::kMono : CameraRole::kLeft);
    CloudPictureOptions options;
    options.title = cloud;
    options.width = 560, options.height = 400;
    options.view = view_from((oMb * camera.bMc).translation(), evaluation_.object());
    names.push_back(fmt::format("cloud_{}.png", benchmark().measures[i].name));
    viewed.push_back(
        {benchmark().measures[i].name, cloud_in_object(shot, score.reconstruction), score.metrics.verdicts});
    write_png(folder / "figures" / names.back(),
              draw_cloud_over_object(viewed.back().cloud, viewed.back().verdicts, evaluation_.object(), options));
  }
  std::vector<ViewedLines> rig;
  for (const CalibratedCamera& camera : shot.info.cameras)
    rig.push_back(camera_pyramid(camera.name, camera.model, oMb * camera.bMc));
  write_whole_file(folder / "figures" / kCloudView, cloud_view_json(evaluation_.object(), viewed, rig));
  return names;
}

}  // namespace tankrig::app
