// `obstacles:` of the rig file and `body:` of its cameras, read, refused and written again.
#include "rig/config/obstacles_section.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/input_error.hpp"
#include "rig/config/camera_section.hpp"

using testing::HasSubstr;

namespace tankrig {
namespace {

constexpr const char* kRequired =
    "tank_size_m: [2, 2, 1.5]\n"
    "wMb: {translation_m: [0.2, 0, 1.2], quaternion_xyzw: [1, 0, 0, 0]}\n"
    "margin_m: 0.02\n"
    "link_radius_m: 0.045\n";

Obstacles read_obstacles(const std::string& more) {
  return settings_from(ConfigNode::parse(kRequired + more, "rig.yaml"), kObstacleKeys);
}

std::string obstacles_yaml(const Obstacles& obstacles) {
  YAML::Emitter out;
  write_mapping(out, kObstacleKeys, obstacles);
  return out.c_str();
}

TEST(ObstaclesSection, HasABaseAndNothingElseWhereTheFileSaysNothing) {
  const Obstacles o = read_obstacles("");
  EXPECT_EQ(o.base.a, Vector3d(0, 0, -0.13));
  EXPECT_EQ(o.base.radius, 0.06);
  EXPECT_EQ(o.tool_length, 0);
  EXPECT_TRUE(o.carried.empty());
  EXPECT_TRUE(o.fixed.empty());
}

TEST(ObstaclesSection, ReadsBoxesAndCapsulesAndReadsBackWhatItWrites) {
  const Obstacles o = read_obstacles(
      "tool_length_m: 0.1\n"
      "base: {from_b_m: [0, 0, -0.2], to_b_m: [0, 0.01, 0], radius_m: 0.07}\n"
      "carried:\n"
      "  - {from_e_m: [-0.1, 0, -0.3], to_e_m: [-0.1, 0, -0.2], radius_m: 0.03}\n"
      "  - {name: \"lamp: green\", from_e_m: [0, 0.1, 0], to_e_m: [0, 0.1, 0], radius_m: 0.02}\n"
      "  - {name: plate, eMbox: {translation_m: [0, 0, 0.1], quaternion_xyzw: [0, 0, 0, 1]}, size_m: [0.1, 0.2, "
      "0.01]}\n"
      "fixed:\n"
      "  - {name: post, from_b_m: [0.6, 0.3, -0.4], to_b_m: [0.6, 0.3, 0.5], radius_m: 0.02}\n"
      "  - {name: beam, bMbox: {translation_m: [0, 0, -0.3], quaternion_xyzw: [0, 0, 0.6, 0.8]}, size_m: [0.1, 2, "
      "0.1]}\n");
  EXPECT_EQ(o.base.b, Vector3d(0, 0.01, 0));
  ASSERT_EQ(o.carried.size(), 3u);
  EXPECT_EQ(o.carried[0].name, "projector") << "unless it is said";
  EXPECT_EQ(o.carried[1].name, "lamp: green");
  EXPECT_EQ(std::get<Box>(o.carried[2].shape).size, Vector3d(0.1, 0.2, 0.01));
  ASSERT_EQ(o.fixed.size(), 2u);
  EXPECT_EQ(std::get<Capsule>(o.fixed[0].shape).radius, 0.02);
  EXPECT_EQ(std::get<Box>(o.fixed[1].shape).size, Vector3d(0.1, 2, 0.1));
  const Obstacles again = settings_from(ConfigNode::parse(obstacles_yaml(o), "rig.yaml"), kObstacleKeys);
  EXPECT_EQ(obstacles_yaml(again), obstacles_yaml(o));
  EXPECT_EQ(again.carried[1].name, "lamp: green");
  EXPECT_TRUE(std::get<Box>(again.fixed[1].shape).xMbox.isApprox(std::get<Box>(o.fixed[1].shape).xMbox, 1e-15));
}

TEST(ObstaclesSection, RefusesWhatIsIllFormedWithItsLine) {
  struct Damage {
    std::string line, message;
  };
  const std::vector<Damage> damages = {
      {"gap_m: 1", "gap_m: unknown key"},
      {"base: {from_b_m: [0, 0], to_b_m: [0, 0, 0], radius_m: 0.06}", "base.from_b_m: found"},
      {"base: {from_b_m: [0, 0, -0.1], to_b_m: [0, 0, 0]}", "base.radius_m: found nothing"},
      {"carried: [{from_e_m: [0, 0, 0], to_e_m: [0, 0, 0], radius_m: -0.1}]", "carried[0].radius_m: found '-0.1'"},
      {"fixed: [{from_b_m: [0, 0, 0], to_b_m: [0, 0, 0], radius_m: 0.1}]", "fixed[0].name: found nothing"},
      {"fixed: [{name: post}]", "fixed[0].from_b_m: found nothing"},
      {"fixed: [{name: post, from_b_m: [0, 0, 300], to_b_m: [0, 0, 0], radius_m: 0.1}]", "millimetres"},
      {"fixed: [{name: beam, size_m: [1, 1, 1]}]", "fixed[0].bMbox"},
      {"fixed: [{name: beam, bMbox: {translation_m: [0, 0, 0], quaternion_xyzw: [0, 0, 0, 1]}, size_m: [1, 0, 1]}]",
       "fixed[0].size_m: found a side that is not positive"},
      {"fixed: [{name: post, from_b_m: [0, 0, 0], to_b_m: [0, 0, 0], radius_m: 0.1, colour: red}]",
       "fixed[0].colour: unknown key"},
  };
  for (const Damage& damage : damages) {
    const std::string error = message_of<InputError>([&] { read_obstacles(damage.line + "\n"); });
    EXPECT_THAT(error, HasSubstr("rig.yaml:5: ")) << damage.line;
    EXPECT_THAT(error, HasSubstr(damage.message)) << damage.line;
  }
}

TEST(CameraBody, IsABoxBetweenTwoCorners) {
  RigCamera camera;
  camera.name = "mono";
  camera.body = {Vector3d(-1, -1, -1), Vector3d(1, 1, 1)};
  const auto read_body = [&](const std::string& text) {
    constexpr bool kComplete = false;
    const ConfigNode node = ConfigNode::parse(text, "rig.yaml");
    read_settings(node, kRigCameraKeys, camera, kComplete);
    node.finish();
  };
  read_body("{}\n");
  EXPECT_EQ(camera.body.max(), Vector3d(1, 1, 1)) << "what is not said stays";
  read_body("body: {min_m: [-0.03, -0.04, -0.07], max_m: [0.03, 0.04, 0.02]}\n");
  EXPECT_EQ(camera.body.min(), Vector3d(-0.03, -0.04, -0.07));
  YAML::Emitter out;
  write_mapping(out, kRigCameraKeys, camera);
  EXPECT_THAT(out.c_str(), HasSubstr("body: {min_m: [-0.03, -0.04, -0.07], max_m: [0.03, 0.04, 0.02]}"));
  EXPECT_THAT(message_of<InputError>([&] { read_body("body: {min_m: [0, 0, 0], max_m: [0.1, 0.1, 0]}\n"); }),
              HasSubstr("rig.yaml:1: body.max_m: found a side that is not positive"));
  EXPECT_THAT(message_of<InputError>([&] { read_body("body: {min_m: [0, 0, 0]}\n"); }),
              HasSubstr("body.max_m: found nothing"));
}

}  // namespace
}  // namespace tankrig
