// Small tanks made in code, with a known truth, for the renderer's tests and benchmarks.
#pragma once

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "sim_backends/world/scene.hpp"
#include "sim_backends/world/tank_world.hpp"

namespace tankrig::sim::testing {

/// Camera at `eye`, its optical axis through `target`, image rows level; w.
inline Transform look_at(const Vector3d& eye, const Vector3d& target, const Vector3d& up = Vector3d::UnitZ()) {
  const Vector3d z = (target - eye).normalized(), x = z.cross(up).normalized();
  Transform wMc = Transform::Identity();
  wMc.linear() << x, z.cross(x), z;
  wMc.translation() = eye;
  return wMc;
}

/// Files that go with the process.
class TemporaryFiles {
 public:
  std::filesystem::path add(const std::string& name) {
    files_.push_back(std::filesystem::temp_directory_path() / ("tankrig_" + std::to_string(::getpid()) + "_" + name));
    return files_.back();
  }
  ~TemporaryFiles() {
    std::error_code ignored;
    for (const auto& file : files_) std::filesystem::remove(file, ignored);
  }

 private:
  std::vector<std::filesystem::path> files_;
};

/// A closed box of `size` with its origin at the centre of the top face, as a mesh file of this process.
inline std::filesystem::path write_box(const Vector3d& size, const std::string& name) {
  static TemporaryFiles files;
  const auto file = files.add(name + ".obj");
  std::ofstream out(file);
  for (int k = 0; k < 8; ++k)
    out << "v " << (k & 1 ? 0.5 : -0.5) * size.x() << ' ' << (k & 2 ? 0.5 : -0.5) * size.y() << ' '
        << (k & 4 ? 0.0 : -size.z()) << '\n';
  out << "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
  return file;
}

/// Clear water, one grey camera above the floor, no light, no object, sensor of 1 digital number per lux.
inline Scene empty_scene() {
  Scene scene;
  scene.file = "made in code";
  scene.ambient_lux = 0;
  scene.tank.floor.albedo = Rgb::Constant(0.5f);
  scene.tank.walls.albedo = Rgb::Zero();
  scene.water.attenuation = scene.water.backscatter = scene.water.veil = Rgb::Zero();
  scene.water.laser_scattering = 0;
  scene.laser.speckle_contrast = 0;
  scene.arm.wMb = make_transform_rpy({0.55, 0, 1.25}, {M_PI, 0, 0});
  CameraSpec camera;
  camera.name = "mono";
  camera.model = {320, 240, 300, 310, 161.3, 118.2};
  camera.wMc = look_at({0, 0.001, 1.0}, {0, 0, 0}, Vector3d::UnitY());
  camera.channels = 1;
  camera.psf_sigma_px = 0;
  camera.exposure_s = 0.010;
  camera.sensor.full_well_e = 10000;
  camera.sensor.electrons_per_lux_s = 10000 / 255.0 / camera.exposure_s;
  scene.cameras = {camera};
  return scene;
}

/// The default tank in the large: box, lamps, arm, a mono camera of 720 x 576 and a stereo pair of 640 x 480.
inline Scene full_scene() {
  Scene scene;
  scene.file = "made in code";
  scene.tank.floor = {{0.36f, 0.36f, 0.34f}, Material::Texture::kSpeckle, 0.04f, 0.02};
  scene.tank.walls = {{0.16f, 0.27f, 0.33f}, Material::Texture::kPlain, 0, 0.01};
  scene.water.veil = {3.0f, 14.0f, 17.0f};
  scene.water.particles_per_m3 = 300;
  scene.ambient_lux = 60;
  scene.arm.wMb = make_transform_rpy({0.55, 0, 1.25}, {M_PI, 0, 0});
  scene.arm.q << 0, 0.12, 1.5, 0, 0;
  scene.laser.name = "seastripe";
  scene.laser.eMl = make_transform_rpy({-0.09796, 0, -0.188}, {0, 0, 0});
  scene.lamps = {{"port", {0.7, -0.7, 1.38}, Vector3d(-0.55, 0.6, -1).normalized(), 340, 1.0, {1, 1, 0.95f}},
                 {"starboard", {-0.2, 0.8, 1.38}, Vector3d(0.2, -0.7, -1).normalized(), 280, 1.0, {1, 1, 0.95f}}};
  SceneObject box;
  box.name = "blackbox";
  box.mesh = write_box({0.14, 0.30, 0.16}, "black_box");
  box.wMo = make_transform_rpy({0.05, 0, 0.16}, {0, 0, 35 * M_PI / 180});
  box.material = {{0.07f, 0.07f, 0.075f}, Material::Texture::kLabels, 0.7f, 0.008};
  box.target = true;
  scene.objects = {box};
  scene.lux_meter.position = {0.2, 0.2, 0.03};

  CameraSpec mono;
  mono.name = "mono";
  mono.model = {720, 576, 626.08, 682.78, 368.93, 284.83, -0.370, 0.174, -0.0016, 0.0029, 0};
  mono.wMc = look_at({0.45, -0.10, 1.13}, {0.0, 0.02, 0.0});
  mono.sensor.full_well_e = 8000;
  mono.sensor.electrons_per_lux_s = 5600;
  CameraSpec left = mono;
  left.name = "left";
  left.model = {640, 480, 765.4, 762.9, 315.7, 236.8};
  left.wMc = look_at({0.40, 0.06, 1.10}, {0.02, 0.0, 0.05});
  CameraSpec right = left;
  right.name = "right";
  right.wMc = left.wMc * Eigen::Translation3d(0.088, 0, 0);
  scene.cameras = {mono, left, right};
  return scene;
}

/// The full scene in a small format, the sheet on the box.
inline Scene small_scene() {
  Scene scene = full_scene();
  for (CameraSpec& c : scene.cameras) {
    c.model.width /= 2, c.model.height /= 2;
    c.model.fx /= 2, c.model.fy /= 2, c.model.cx /= 2, c.model.cy /= 2;
  }
  scene.arm.q[kElbow] = 1.8;
  return scene;
}

/// Arm at rest in the scene's posture.
inline Exposure still(const Scene& scene, double laser_power) {
  Exposure exposure;
  exposure.q.fill(scene.arm.q);
  exposure.laser.fill(laser_power);
  return exposure;
}

}  // namespace tankrig::sim::testing
