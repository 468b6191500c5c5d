#include "apps/tankrig/devices/camera_info.hpp"

namespace tankrig::app {
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

CameraInfo camera_info(const RigConfig& rig, const RigCamera& camera) {
  const auto devices = rig.section("devices");
  const auto cameras = devices ? devices->optional_child("cameras") : std::nullopt;
  const auto node = cameras ? cameras->optional_child(camera.name) : std::nullopt;
  CameraInfo info{
      .name = camera.name, .width = camera.model.width, .height = camera.model.height, .rate_hz = camera.rate_hz};
  if (node) read_settings(*node, kDeviceCameraKeys, info);
  return info;
}

}  // namespace tankrig::app
