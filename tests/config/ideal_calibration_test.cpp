// The rigs we ship are calibrated perfectly: what they say is what is true in their scenes.
#include <gtest/gtest.h>

#include <algorithm>

#include "core/model_yaml.hpp"
#include "rig/config/rig_config.hpp"
#include "sim_backends/world/scene.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

/// The message holds the truth in the rig file's own form, to paste.
void expect_same(const Transform& said, const Transform& truth, const std::string& what) {
  EXPECT_LT((said.translation() - truth.translation()).norm(), 1e-6) << what << ": " << yaml_of(truth);
  EXPECT_LT(Eigen::AngleAxisd(said.linear().transpose() * truth.linear()).angle(), 1e-6)
      << what << ": " << yaml_of(truth);
}

void expect_same(const CameraModel& said, const CameraModel& truth) { EXPECT_EQ(yaml_of(said), yaml_of(truth)); }

class IdealCalibration : public testing::TestWithParam<const char*> {
 protected:
  const RigConfig rig_ = load_rig(fs::path(TANKRIG_SOURCE_DIR) / "etc/rigs" / GetParam() / "rig.yaml");
  const sim::Scene scene_ = sim::read_scene(rig_.scene);
  const Transform bMw_ = scene_.arm.wMb.inverse();
};

TEST_P(IdealCalibration, HasTheCamerasOfTheScene) {
  ASSERT_EQ(rig_.cameras.size(), scene_.cameras.size());
  for (const RigCamera& camera : rig_.cameras) {
    const auto truth = std::find_if(scene_.cameras.begin(), scene_.cameras.end(),
                                    [&](const auto& c) { return c.name == camera.name; });
    ASSERT_NE(truth, scene_.cameras.end()) << camera.name;
    expect_same(camera.model, truth->model);
    expect_same(camera.bMc, bMw_ * truth->wMc, camera.name + ".bMc");
    EXPECT_EQ(camera.rate_hz, truth->rate_hz);
  }
}

TEST_P(IdealCalibration, HasTheLaserOfTheScene) {
  const Transform& eMl = scene_.laser.eMl;
  const Plane truth = eMl * Plane{Vector3d::UnitX(), 0};
  EXPECT_LT((rig_.laser.ePl.normal - truth.normal).norm(), 1e-6) << yaml_of(truth);
  EXPECT_NEAR(rig_.laser.ePl.offset, truth.offset, 1e-6) << yaml_of(truth);
  EXPECT_LT((rig_.laser.origin_e - eMl.translation()).norm(), 1e-6);
  EXPECT_LT((rig_.laser.direction_e - eMl.linear().col(2)).norm(), 1e-6);
  EXPECT_NEAR(rig_.laser.fan, scene_.laser.fan, 1e-4);
}

TEST_P(IdealCalibration, HasTheArmTankAndObjectOfTheScene) {
  const auto target =
      std::find_if(scene_.objects.begin(), scene_.objects.end(), [](const auto& o) { return o.target; });
  ASSERT_NE(target, scene_.objects.end());
  expect_same(rig_.object.bMo, bMw_ * target->wMo, "object.bMo");
  EXPECT_EQ(fs::weakly_canonical(rig_.object.mesh), fs::weakly_canonical(target->mesh));
  expect_same(rig_.obstacles.wMb, scene_.arm.wMb, "obstacles.wMb");
  EXPECT_EQ(rig_.obstacles.tank_size, scene_.tank.size);
  EXPECT_EQ(rig_.scan.park, scene_.arm.q) << "the scene's jointValues are where the arm is parked";
  const ArmModel &said = rig_.arm, &truth = scene_.arm.model;
  EXPECT_EQ(yaml_of(said), yaml_of(truth));
}

INSTANTIATE_TEST_SUITE_P(Rigs, IdealCalibration, testing::Values("tank-sim", "lab-published"), [](const auto& param) {
  return std::string(param.param) == "tank-sim" ? "TankSim" : "LabPublished";
});

}  // namespace
}  // namespace tankrig
