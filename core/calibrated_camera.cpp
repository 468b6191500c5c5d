#include "core/calibrated_camera.hpp"

#include "core/session_names.hpp"
#include "core/settings_table.hpp"
#include "core/shown_text.hpp"

namespace tankrig {
namespace {

using Camera = CalibratedCamera;
const Setting<Camera> kCalibratedCameraRows[] = {
    {"name", &Camera::name, "a folder's name: no blank, comma, quote, slash, backslash or leading dot",
     Need::kRequired},
    {"role", &Camera::role, "one camera each; left and right are the eyes of the stereo pair", Need::kRequired},
    {"model", &Camera::model, kCameraModelKeys, Need::kRequired, YAML::Flow},
    {"bMc", &Camera::bMc, "the camera in the arm's base", Need::kRequired},
    {"time_offset_s", &Camera::time_offset, ConfigRange(-1, 1),
     "t_camera - t_joints, taken off the stamps ([calibration.md](calibration.md))", Need::kSparse},
};

void check_name(const ConfigNode& node, const Camera& camera) {
  if (!is_camera_name(camera.name))
    node.fail("name", "found '" + shown_text(camera.name) +
                          "', expected a name that can be a folder's, without blanks, commas, quotes, slashes or a "
                          "dot at its front");
}

}  // namespace

constinit const SettingsTable<CalibratedCamera> kCalibratedCameraKeys{kCalibratedCameraRows, check_name};

}  // namespace tankrig
