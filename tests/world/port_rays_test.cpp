// The renderer's own tracing through a port against the model of those who calibrate and reconstruct.
#include "sim_backends/world/port_rays.hpp"

#include <gtest/gtest.h>

#include <iostream>
#include <random>

namespace tankrig::sim {
namespace {

TEST(PortRays, AgreeWithTheModelOfThoseWhoMeasure) {
  constexpr unsigned kSeed = 11;
  std::cout << "seed " << kSeed << "\n";
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> share(0, 1);
  for (int i = 0; i < 10000; ++i) {
    FlatPort port{0.1 * share(random), 0.03 * share(random)};
    port.normal = Vector3d(0.6 * share(random) - 0.3, 0.6 * share(random) - 0.3, 1).normalized();
    port.glass = 1.4 + 0.3 * share(random), port.water = 1.3 + 0.1 * share(random), port.air = 1 + 0.01 * share(random);
    const Vector3d direction = Vector3d(2 * share(random) - 1, 2 * share(random) - 1, 1).normalized();
    const PortRay traced = through_port(port, direction);
    const ViewingRay model = port.beyond(direction);
    ASSERT_LT((traced.origin - model.origin).norm(), 1e-14);
    ASSERT_LT((traced.direction - model.direction).norm(), 1e-14);
  }
}

}  // namespace
}  // namespace tankrig::sim
