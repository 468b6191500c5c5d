#include "apps/tankrig/calibrate_all/simulated_operator.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <string>

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
  std::string text = fmt::format("# Clicked by the simulated operator, to {:g} px.\ncorners:\n", sigma_px);
  int found = 0;
  for (std::uint64_t corner = 0; corner < 8; ++corner) {
    Vector3d o;
    std::string name;
    for (int axis = 0; axis < 3; ++axis) {
      const bool high = (corner >> axis) & 1;
      o[axis] = high ? shape.bounds().max()[axis] : shape.bounds().min()[axis];
      name += fmt::format("{}{}", high ? '+' : '-', "xyz"[axis]);
    }
    const auto pixel = eye->model.project(cMo * o);
    if (!pixel || !shape.sees(cMo.inverse().translation(), o) || pixel->minCoeff() < 0 ||
        pixel->x() > eye->model.width - 1 || pixel->y() > eye->model.height - 1)
      continue;
    const std::uint64_t random = sim::mix(seed ^ sim::hash_text(camera), corner);
    text += fmt::format("  - {{name: \"{}\", pixel_px: [{:.2f}, {:.2f}]}}\n", name,
                        pixel->x() + sigma_px * normal(random), pixel->y() + sigma_px * normal(sim::mix(random)));
    ++found;
  }
  if (found < 4)
    throw InputError(fmt::format("camera {} sees {} of the object's corners, expected four or more", camera, found));
  write_file_durably(file, text);
}

}  // namespace tankrig::app
