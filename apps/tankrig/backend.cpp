#include "apps/tankrig/backend.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include "core/input_error.hpp"
#include "sim_backends/mock/mock_arm.hpp"
#include "sim_backends/mock/mock_camera.hpp"
#include "sim_backends/mock/mock_laser.hpp"
#include "sim_backends/mock/mock_lux_meter.hpp"

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
  char text[80];
  std::snprintf(text, sizeof text, "%.1f mm and %.2f degrees", 1e3 * length, angle * 180 / std::numbers::pi);
  return text;
}

/// Largest distance between the pixels at which two models see the same points of the image [px].
double pixel_difference(const CameraModel& rig, const CameraModel& scene) {
  double worst = 0;
  for (double v : {0.1, 0.5, 0.9})
    for (double u : {0.1, 0.5, 0.9}) {
      const Vector2d pixel(u * scene.width, v * scene.height);
      const auto seen = rig.project(scene.ray(pixel.x(), pixel.y()));
      worst = std::max(worst, seen ? (*seen - pixel).norm() : std::numeric_limits<double>::infinity());
    }
  return worst;
}

/// Where the rig file's calibration is not what is true in its scene: meant in a study of calibration errors, else a
/// mistake.
std::vector<std::string> calibration_errors(const RigConfig& rig, const sim::TankWorld& world) {
  const std::string meant = " from where the scene has it: a calibration error, if it is meant";
  const Transform bMw = world.wMb().inverse();
  std::vector<std::string> out;
  for (const RigCamera& camera : rig.cameras)
    for (const sim::SceneCamera& truth : world.cameras()) {
      if (truth.name != camera.name) continue;
      if (const auto d = pose_difference(camera.bMc, bMw * truth.wMc))
        out.push_back("camera " + camera.name + " stands " + *d + meant);
      const double pixels = pixel_difference(camera.model, truth.model);
      char text[120];
      std::snprintf(text, sizeof text, "camera %s: model differs by up to %.2f px from the scene's",
                    camera.name.c_str(), pixels);
      if (!(pixels <= kSamePixel)) out.emplace_back(text);
    }
  if (const auto d = pose_difference(rig.object.bMo, bMw * world.wMo())) out.push_back("object stands " + *d + meant);
  const Plane sheet{world.eMl().linear().col(0), -world.eMl().linear().col(0).dot(world.eMl().translation())};
  const double angle = std::acos(std::min(1.0, std::abs(sheet.normal.dot(rig.laser.ePl.normal))));
  const double offset = std::abs(std::abs(sheet.offset) - std::abs(rig.laser.ePl.offset));
  if (angle > kSameAngle || offset > kSameLength) {
    char text[120];
    std::snprintf(text, sizeof text, "laser sheet stands %.1f mm and %.2f degrees", 1e3 * offset,
                  angle * 180 / std::numbers::pi);
    out.push_back(text + meant);
  }
  return out;
}

/// In-process devices on the simulated tank, under the virtual clock.
class MockBackend final : public Backend {
 public:
  MockBackend(const RigConfig& rig, const sim::WorldOptions& options)
      : world_(sim::TankWorld::load(rig.scene, options)),
        parameters_(read_parameters(rig)),
        arm_(world_.arm(), parameters_.arm, rig.scan.park, clock_),
        laser_(parameters_.laser_warm_up, clock_),
        lux_meter_([this] { return world_.lux(); }, clock_, parameters_.lux_relative_noise, options.seed) {
    for (const RigCamera& camera : rig.cameras) cameras_.push_back(make_camera(rig, camera));
    warnings_ = world_.warnings();
    for (const std::string& difference : calibration_errors(rig, world_)) warnings_.push_back(difference);
  }

  std::vector<std::string> warnings() const override { return warnings_; }

  Clock& clock() override { return clock_; }
  Arm& arm() override { return arm_; }
  Laser& laser() override { return laser_; }
  LuxMeter& lux_meter() override { return lux_meter_; }
  bool interlock_closed() const override { return true; }  // nobody stands in the simulated beam
  std::string noise() const override { return world_.noise_description(); }
  const sim::TankWorld* world() const override { return &world_; }
  std::vector<Camera*> cameras() override {
    std::vector<Camera*> out;
    for (const auto& camera : cameras_) out.push_back(camera.get());
    return out;
  }

 private:
  static sim::MockParameters read_parameters(const RigConfig& rig) {
    const auto section = rig.section("mock");
    if (!section) return {};
    const sim::MockParameters parameters = sim::parameters_from(*section);
    section->finish();
    return parameters;
  }

  std::unique_ptr<sim::MockCamera> make_camera(const RigConfig& rig, const RigCamera& camera) {
    const auto& known = world_.cameras();
    const auto seen = std::find_if(known.begin(), known.end(), [&](const auto& c) { return c.name == camera.name; });
    if (seen == known.end())
      throw InputError(rig.file, "cameras: '" + camera.name + "' is not a virtualCamera of " + rig.scene.string());
    if (seen->model.width != camera.model.width || seen->model.height != camera.model.height)
      throw InputError(rig.file, "cameras: '" + camera.name + "' is " + std::to_string(camera.model.width) + "x" +
                                     std::to_string(camera.model.height) + " px, expected its size in " +
                                     rig.scene.string() + ": " + std::to_string(seen->model.width) + "x" +
                                     std::to_string(seen->model.height));
    sim::MockCameraParameters parameters = parameters_.camera;
    parameters.exposure = from_seconds(seen->exposure_s);
    return std::make_unique<sim::MockCamera>(
        CameraInfo{camera.name, camera.model.width, camera.model.height, seen->channels, camera.rate_hz}, parameters,
        clock_, arm_, laser_,
        [this](const std::string& name, const sim::Exposure& exposure) { return world_.render(name, exposure); });
  }

  sim::TankWorld world_;
  VirtualClock clock_;
  sim::MockParameters parameters_;
  sim::MockArm arm_;
  sim::MockLaser laser_;
  sim::MockLuxMeter lux_meter_;
  std::vector<std::unique_ptr<sim::MockCamera>> cameras_;
  std::vector<std::string> warnings_;
};

}  // namespace

std::unique_ptr<Backend> make_backend(const RigConfig& rig, const sim::WorldOptions& options) {
  if (rig.backend == "mock") return std::make_unique<MockBackend>(rig, options);
  throw InputError(rig.file, "backend: found '" + rig.backend + "', expected mock");
}

}  // namespace tankrig::app
