#include "apps/tankrig/experiment/experiment_figures.hpp"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "bench/sweep/strip.hpp"
#include "bench/sweep/sweep_report.hpp"
#include "core/text_files.hpp"
#include "session/reading/picture_file.hpp"
#include "session/reading/session.hpp"
#include "session/recording/png_file.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

using Views = std::vector<std::pair<std::string, cv::Mat>>;

constexpr int kWidth = 320;  ///< of one picture [px]

/// What the laser's camera sees in the middle of the sweep; empty if it recorded nothing there.
cv::Mat camera_view(const fs::path& path) {
  const Session session = Session::open(path);
  const CalibratedCamera& mono = session.camera(CameraRole::kMono);
  std::vector<const FrameRecord*> lit;
  for (const FrameRecord& frame : session.frames)
    if (frame.camera == mono.name && frame.laser_on) lit.push_back(&frame);
  if (lit.empty()) return {};
  cv::Mat view = session.image(*lit[lit.size() / 2]);
  if (view.channels() == 1) cv::cvtColor(view, view, cv::COLOR_GRAY2BGR);
  return view;
}

/// All of them, of the first one's size, or no file: a strip with a gap would say that it was dark there.
void write_strip(const fs::path& file, Views views, std::size_t columns) {
  if (views.empty()) return;
  for (auto& [caption, view] : views) {
    if (view.empty()) return;
    if (view.size() != views.front().second.size()) cv::resize(view, view, views.front().second.size());
  }
  write_whole_file(file, png_of(view_strip(views, static_cast<int>(columns), kWidth), file));
}

}  // namespace

void write_experiment_figures(const fs::path& folder, const std::vector<PicturedSession>& sessions,
                              const std::vector<std::string>& clouds) {
  const fs::path figures = folder / "figures";
  fs::create_directories(figures);
  Views outside, camera, grid;
  const auto picture = [](const PicturedSession& session, const std::string& name) {
    const fs::path file = session.path / "pictures" / (name + ".png");
    return fs::exists(file) ? decode_picture(read_whole_file(file), file, nullptr, cv::IMREAD_COLOR) : cv::Mat();
  };
  for (const PicturedSession& session : sessions) {
    outside.emplace_back(session.caption, picture(session, "rig"));
    camera.emplace_back(session.caption, camera_view(session.path));
  }
  for (const std::string& cloud : clouds)
    for (const PicturedSession& session : sessions)
      grid.emplace_back(cloud + ", " + session.caption, picture(session, cloud + "_camera"));
  write_strip(figures / kViewsOutside, outside, sessions.size());
  write_strip(figures / kViewsCamera, camera, sessions.size());
  write_strip(figures / kCloudGrid, grid, sessions.size());
}

}  // namespace tankrig::app
