#include "apps/tankrig/bench/point_pictures.hpp"

#include <opencv2/imgproc.hpp>

#include "bench/report/base64.hpp"
#include "bench/report/cloud_picture.hpp"
#include "core/picture_codecs.hpp"

namespace tankrig::app {
namespace {

constexpr int kWidth = 320;   // [px]
constexpr int kQuality = 70;  // of a JPEG

std::string jpeg(const cv::Mat& picture) {
  cv::Mat small;
  cv::resize(picture, small, {kWidth, picture.rows * kWidth / picture.cols}, 0, 0, cv::INTER_AREA);
  return base64(picture_jpeg(small, kQuality));
}

}  // namespace

std::vector<PointView> frame_views(const Session& session) {
  std::vector<PointView> views;
  const auto add = [&](CameraRole role, bool (*wanted)(const FrameRecord&), const std::string& what) {
    const CalibratedCamera* const camera = session.find_camera(role);
    if (!camera) return;
    const auto frames = frames_of(session, *camera, wanted);
    if (frames.empty()) return;
    const FrameRecord& frame = *frames[frames.size() / 2];
    if (session.unwritten.contains(frame.file) || std::filesystem::exists(session.path / frame.file))
      views.push_back({camera->name + what, "", jpeg(session.image(frame))});
  };
  const auto lit = [](const FrameRecord& frame) { return frame.laser_on; };
  const auto dark = [](const FrameRecord& frame) { return !frame.laser_on; };
  add(CameraRole::kMono, lit, ", laser on");
  add(CameraRole::kMono, dark, ", laser off");
  add(CameraRole::kLeft, dark, "");
  add(CameraRole::kRight, dark, "");
  return views;
}

PointView cloud_view(const Session& session, const Score& score, const std::string& measure,
                     const CalibratedCamera& camera, const TriangleMesh& object) {
  CloudPictureOptions options;
  options.width = 480, options.height = 360;
  options.view = view_from((session.info.object->bMo.inverse() * camera.bMc).translation(), object);
  const cv::Mat picture =
      draw_cloud_over_object(cloud_in_object(session, score.reconstruction), score.metrics.verdicts, object, options);
  return {measure, measure, jpeg(picture)};
}

}  // namespace tankrig::app
