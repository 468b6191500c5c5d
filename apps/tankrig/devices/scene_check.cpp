#include "apps/tankrig/devices/scene_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/angles.hpp"
#include "core/input_error.hpp"
#include "core/text_files.hpp"

namespace tankrig::app {
namespace {

constexpr double kSameLength = 1e-4;  // [m]
constexpr double kSameAngle = 1e-4;   // [rad]
constexpr double kSamePixel = 0.05;   // [px]

/// How far apart two poses are, in words; nothing if they are the same.
std::optional<std::string> pose_difference(const Transform& rig, const Transform& scene) {
  const double length = (rig.translation() - scene.translation()).norm();
  const double angle = Eigen::AngleAxisd(rig.linear().transpose() * scene.linear()).angle();
  if (length <= kSameLength && angle <= kSameAngle) return std::nullopt;
  return fmt::format("{:.1f} mm and {:.2f} degrees", 1e3 * length, to_degrees(angle));
}

/// Largest distance between the pixels at which two models see the same points of the image [px].
double pixel_difference(const CameraModel& rig, const CameraModel& scene) {
  double worst = 0;
  for (double v : {0.1, 0.5, 0.9})
    for (double u : {0.1, 0.5, 0.9}) {
      const Vector2d pixel(u * scene.width, v * scene.height);
      const auto seen = rig.project(scene.sight(pixel.x(), pixel.y()).at(1));
      worst = std::max(worst, seen ? (*seen - pixel).norm() : std::numeric_limits<double>::infinity());
    }
  return worst;
}

}  // namespace

std::vector<std::string> calibration_errors(const RigConfig& rig, const sim::TankWorld& world) {
  const std::string meant = " from where the scene has it: a calibration error, if it is meant";
  const Transform bMw = world.wMb().inverse();
  std::vector<std::string> out;
  for (const RigCamera& camera : rig.cameras)
    for (const sim::CameraSpec& truth : world.cameras()) {
      if (truth.name != camera.name) continue;
      if (const auto d = pose_difference(camera.bMc, bMw * truth.wMc))
        out.push_back("camera " + camera.name + " stands " + *d + meant);
      const double pixels = pixel_difference(camera.model, truth.model);
      if (!(pixels <= kSamePixel))
        out.push_back(fmt::format("camera {}: model differs by up to {:.2f} px from the scene's", camera.name, pixels));
    }
  if (const auto d = pose_difference(rig.object.bMo, bMw * world.wMo())) out.push_back("object stands " + *d + meant);
  if (read_whole_file(rig.object.mesh) != read_whole_file(world.object_mesh()))
    out.push_back("object: " + rig.object.mesh.filename().string() + " is another mesh than the scene's " +
                  world.object_mesh().filename().string() + ": scores are against a shape that is not there");
  if (const auto d = pose_difference(rig.obstacles.wMb, world.wMb())) out.push_back("arm stands " + *d + meant);
  const Plane sheet{world.eMl().linear().col(0), -world.eMl().linear().col(0).dot(world.eMl().translation())};
  const double angle = std::acos(std::min(1.0, std::abs(sheet.normal.dot(rig.laser.ePl.normal))));
  const double offset = std::abs(std::abs(sheet.offset) - std::abs(rig.laser.ePl.offset));
  if (angle > kSameAngle || offset > kSameLength)
    out.push_back(
        fmt::format("laser sheet stands {:.1f} mm and {:.2f} degrees{}", 1e3 * offset, to_degrees(angle), meant));
  return out;
}

const sim::CameraSpec& scene_camera(const RigConfig& rig, const RigCamera& camera, const sim::TankWorld& world) {
  const auto& known = world.cameras();
  const auto seen = std::find_if(known.begin(), known.end(), [&](const auto& c) { return c.name == camera.name; });
  if (seen == known.end())
    throw InputError(rig.file, "cameras: '" + camera.name + "' is not a virtualCamera of " + rig.scene.string());
  if (seen->model.width != camera.model.width || seen->model.height != camera.model.height)
    throw InputError(rig.file, fmt::format("cameras: '{}' is {}x{} px, expected its size in {}: {}x{}", camera.name,
                                           camera.model.width, camera.model.height, rig.scene.string(),
                                           seen->model.width, seen->model.height));
  return *seen;
}

std::optional<sim::TrueRig> true_rig(const RigConfig& rig, const sim::WorldOptions& options) {
  const auto section = rig.section("truth");
  if (!section) return std::nullopt;
  sim::TrueRig truth = settings_from(*section, sim::kTrueRigKeys);
  truth.seed = options.truth_seed.value_or(truth.seed);
  return truth;
}

sim::TankWorld load_world(const RigConfig& rig, sim::WorldOptions options) {
  options.truth = true_rig(rig, options);
  return sim::TankWorld::load(rig.scene, options);
}

std::vector<std::string> scene_warnings(const RigConfig& rig, const sim::TankWorld& world) {
  std::vector<std::string> out = world.warnings();
  if (rig.section("truth")) return out;  // such a rig is there to be calibrated
  for (const std::string& difference : calibration_errors(rig, world)) out.push_back(difference);
  return out;
}

}  // namespace tankrig::app
