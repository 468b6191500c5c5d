#include "apps/tankrig/scan/plan_check.hpp"

#include <utility>

#include "bench/metrics/triangle_mesh.hpp"
#include "core/input_error.hpp"
#include "core/settings_table.hpp"
#include "rig/platform/machine.hpp"
#include "session/recording/spool_pictures.hpp"

namespace tankrig::app {
namespace {

/// Tables, logs, clouds, pictures, report, and the recorder's reserve.
constexpr std::uint64_t kBesideFrames = 64 << 20;

}  // namespace

MotionCheck check_plan(const RigConfig& rig, const ScanPlan& plan) {
  Obstacles obstacles = rig.obstacles;
  for (const RigCamera& camera : rig.cameras) obstacles.cameras.push_back({camera.name, camera.housing()});
  TriangleMesh mesh = read_mesh(rig.object.mesh);
  for (Vector3d& vertex : mesh.vertices) vertex = rig.object.bMo * vertex;
  obstacles.object = {std::move(mesh.vertices), std::move(mesh.triangles)};
  return check_motion(plan, rig.arm, obstacles, rig.motion_limits);
}

int expected_frames(const RigConfig& rig, const RigCamera& camera, const ScanPlan& plan) {
  const double period = 1 / camera.rate_hz;
  const double in_sweep =
      camera.trigger.mode == TriggerMode::kPosition ? camera.trigger.spacing / rig.scan.sweep.velocity : period;
  int frames = 0;
  if (camera.record != RecordWhen::kSweep)
    frames += plan.expected_frames(RecordWhen::kDark, period, rig.scan.capture.dark_frames);
  if (camera.record != RecordWhen::kDark && camera.trigger.mode == TriggerMode::kPosition)
    frames += rig.scan.sweep.passes;  // a pass has an angle more than spacings
  if (camera.record != RecordWhen::kDark)
    frames += plan.expected_frames(RecordWhen::kSweep, in_sweep, rig.scan.capture.dark_frames);
  return frames;
}

namespace {

const Setting<CameraInfo> kDeviceCameraRows[] = {
    {"driver",
     {[](const ConfigNode& node, const char* key, CameraInfo&) {
        static_cast<void>(node.choice(key, {"aravis", "v4l2"}));
      },
      nullptr, "aravis, v4l2"},
     "GigE Vision or USB3 Vision ([gige.md](gige.md)); Video for Linux ([v4l2.md](v4l2.md))",
     tankrig::Need::kRequired},
    {"channels", &CameraInfo::channels, ConfigRange(1, 3), "1 (grey) or 3 (BGR), of the pictures in the session"},
};
void check_channels(const ConfigNode& node, const CameraInfo& info) {
  if (info.channels == 2) node.fail("channels", "found 2, expected 1 (grey) or 3 (colour)");
}

}  // namespace

constinit const SettingsTable<CameraInfo> kDeviceCameraKeys{kDeviceCameraRows, check_channels};

/// As its driver delivers it.
CameraInfo camera_info(const RigConfig& rig, const RigCamera& camera) {
  const auto devices = rig.section("devices");
  const auto cameras = devices ? devices->optional_child("cameras") : std::nullopt;
  const auto node = cameras ? cameras->optional_child(camera.name) : std::nullopt;
  CameraInfo info{
      .name = camera.name, .width = camera.model.width, .height = camera.model.height, .rate_hz = camera.rate_hz};
  if (node) read_settings(*node, kDeviceCameraKeys, info);
  return info;
}

std::uint64_t disk_need(const RigConfig& rig, const ScanPlan& plan) {
  std::uint64_t raw = 0;
  for (const RigCamera& camera : rig.cameras) {
    const CameraInfo info = camera_info(rig, camera);
    raw += static_cast<std::uint64_t>(expected_frames(rig, camera, plan)) * static_cast<std::uint64_t>(info.channels) *
           static_cast<std::uint64_t>(info.width) * static_cast<std::uint64_t>(info.height);
  }
  return most_on_disk(raw) + kBesideFrames;
}

void check_room(const RigConfig& rig, const ScanPlan& plan, const std::filesystem::path& path) {
  const Finding room = room_finding(path, free_space(path), disk_need(rig, plan));
  if (room.refused) throw InputError(room.measured + "; nothing was moved; " + room.cure);
}

}  // namespace tankrig::app
