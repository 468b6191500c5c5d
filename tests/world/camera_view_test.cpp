// Four lines of sight at once are those that come one by one.
#include "sim_backends/world/camera_view.hpp"

#include <gtest/gtest.h>

#include "tests/world/render_scene.hpp"

namespace tankrig::sim::testing {
namespace {

TEST(CameraView, HasTheSameSightsFourAtATime) {
  const Scene scene = small_scene();
  const RenderGeometry geometry(scene);
  const Radiometry radiometry(scene, geometry);
  for (const bool port : {false, true}) {
    CameraSpec spec = scene.cameras.front();
    if (port) spec.model.port = FlatPort{0.03, 0.01};
    const CameraView view(spec, geometry, radiometry);
    for (int u = -2; u < view.width() + 2; ++u)
      for (const float v : {-0.875f, 10.125f, static_cast<float>(view.height()) + 0.5f}) {
        const auto four = view.quarter_sights(u, v);
        for (int k = 0; k < 4; ++k) {
          const auto one = view.sight(static_cast<float>(u) + 0.25f * static_cast<float>(k) - 0.375f, v);
          ASSERT_EQ(Vector3f(four.origin.row(k)), one.origin) << "port " << port << ", column " << u << ", row " << v;
          ASSERT_EQ(Vector3f(four.direction.row(k)), one.direction)
              << "port " << port << ", column " << u << ", row " << v;
        }
      }
  }
}

}  // namespace
}  // namespace tankrig::sim::testing
