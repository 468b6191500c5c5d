#include "apps/tankrig/calibrate_all/simulated_operator.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <string>

#include "calibration/object_pose/corners_file.hpp"
#include "core/atomic_file.hpp"
#include "core/input_error.hpp"
#include "sim_backends/world/hash_noise.hpp"

namespace tankrig::app {

void click_corners(const sim::TankWorld& tank, const std::string& camera, const ObjectShape& shape, double sigma_px,
                   std::uint64_t seed, const std::filesystem::path& file) {
  const auto& cameras = tank.cameras();
  const auto eye = std::find_if(cameras.begin(), cameras.end(), [&](const auto& c) { return c.name == camera; });
  if (eye == cameras.end()) throw InputError("the scene has no camera " + camera);
  const Transform cMo = eye->wMc.inverse() * tank.wMo();
  const auto& normal = sim::GaussianTable::instance();
  std::vector<CornersFile::Corner> clicked;
  std::uint64_t corner = 0;
  for (const auto& [name, o] : bounding_corners(shape)) {
    const std::uint64_t random = sim::mix(seed ^ sim::hash_text(camera), corner++);
    const auto pixel = eye->model.project(cMo * o);
    if (!pixel || !shape.sees(cMo.inverse().translation(), o) || pixel->minCoeff() < 0 ||
        pixel->x() > eye->model.width - 1 || pixel->y() > eye->model.height - 1)
      continue;
    clicked.push_back({name, {}, *pixel + sigma_px * Vector2d(normal(random), normal(sim::mix(random)))});
  }
  if (clicked.size() < 4)
    throw InputError(
        fmt::format("camera {} sees {} of the object's corners, expected four or more", camera, clicked.size()));
  write_file_durably(file, corners_text(fmt::format("the simulated operator, to {:g} px", sigma_px), clicked));
}

}  // namespace tankrig::app
