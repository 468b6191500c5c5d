// Scene files: what they mean, and what each kind of mistake is told.
#include "sim_backends/world/scene.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <sstream>

#include "core/input_error.hpp"
#include "sim_backends/world/tank_world.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::sim {
namespace {

const std::filesystem::path kEtc = std::filesystem::path(TANKRIG_SOURCE_DIR) / "etc";

std::string default_text() {
  std::ifstream in(kEtc / "scenes/tank.xml");
  std::ostringstream text;
  text << in.rdbuf();
  std::string s = text.str();
  s.replace(s.find("../objects"), 10, (kEtc / "objects").string());
  return s;
}

std::string replaced(const std::string& from, const std::string& to) {
  std::string s = default_text();
  const auto at = s.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? s : s.replace(at, from.size(), to);
}

Scene read(const std::string& text) {
  const TemporaryFolder folder;
  return read_scene(folder.write("scene_test.xml", text));
}

int line_of(const std::string& text, const std::string& part) {
  return 1 + static_cast<int>(std::count(text.begin(), text.begin() + static_cast<long>(text.find(part)), '\n'));
}

/// The default scene with `from` changed to `to` is refused at the line of `at`, in words that hold `words`.
void expect_refused(const std::string& from, const std::string& to, const std::string& at, const std::string& words) {
  const std::string text = replaced(from, to);
  try {
    read(text);
    ADD_FAILURE() << "accepted " << to;
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("scene_test.xml:" + std::to_string(line_of(text, at)) + ": "));
    EXPECT_THAT(error.what(), ::testing::HasSubstr(words));
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
}

TEST(SceneFile, DefaultSceneReadsWithoutWarning) {
  const Scene scene = read_scene(kEtc / "scenes/tank.xml");
  EXPECT_TRUE(scene.warnings.empty());
  ASSERT_EQ(scene.cameras.size(), 3u);
  EXPECT_EQ(scene.cameras[0].model.width, 720);
  EXPECT_DOUBLE_EQ(scene.cameras[0].model.k1, -0.370);
  EXPECT_TRUE(
      (scene.cameras[1].wMc.inverse() * scene.cameras[2].wMc).isApprox(Transform(Eigen::Translation3d(0.088, 0, 0))));
  EXPECT_TRUE(scene.laser.eMl.isApprox(Transform(Eigen::Translation3d(-0.09796, 0, -0.188))));
  EXPECT_NEAR(scene.laser.fan, 0.9, 1e-5);
  EXPECT_TRUE(scene.objects.at(0).target);
  EXPECT_EQ(scene.water.particles_per_m3, 300);
}

TEST(SceneFile, PutsACameraBehindAFlatPort) {
  const std::string port =
      "<port><distance>0.04</distance><thickness>0.008</thickness><normal><x>0</x><y>0.06</y><z>0.8</z></normal>"
      "<indexWater>1.34</indexWater></port>\n";
  const Scene scene = read(replaced("<distortion>", port + "<distortion>"));
  ASSERT_TRUE(scene.cameras[0].model.port);
  EXPECT_EQ(scene.cameras[0].model.port->distance, 0.04);
  EXPECT_EQ(scene.cameras[0].model.port->thickness, 0.008);
  EXPECT_EQ(scene.cameras[0].model.port->water, 1.34);
  EXPECT_NEAR(scene.cameras[0].model.port->normal.norm(), 1, 1e-15);
  const auto refused = [&](const std::string& bad, const std::string& words) {
    expect_refused("<distortion>", bad + "<distortion>", "<port>", words);
  };
  refused("<port><distance>40</distance><thickness>0.008</thickness></port>\n", "distance");
  refused("<port><distance>0.04</distance></port>\n", "thickness");
  refused(
      "<port><distance>0.04</distance><thickness>0.008</thickness><normal><x>0</x><y>0</y><z>-1</z></normal></port>\n",
      "found pixels that do not look through it");
}

TEST(SceneFile, TellsAMissingFileFromAnEmptyOne) {
  const auto error = [](auto action) {
    try {
      action();
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(error([] { read(""); }), ::testing::EndsWith("scene_test.xml: is empty, expected a UWSimScene"));
  EXPECT_THAT(error([] { read(" \n\n"); }), ::testing::EndsWith("scene_test.xml: is empty, expected a UWSimScene"));
  EXPECT_THAT(error([] { read_scene("/no/such/scene.xml"); }),
              ::testing::EndsWith("/no/such/scene.xml: cannot be read, expected a UWSimScene"));
  EXPECT_THAT(error([] { read_scene(kEtc); }), ::testing::EndsWith("etc: is a folder, expected a UWSimScene"));
  EXPECT_THAT(error([] { read("<?xml version=\"1.0\"?>\n"); }), ::testing::HasSubstr("expected <UWSimScene>"));
  EXPECT_THAT(error([] { read(default_text() + std::string("\0rest", 5)); }), ::testing::HasSubstr("found a byte 0"));
}

TEST(SceneFile, RefusesWhatStandsBesideItsRootElement) {
  const auto after = [](const std::string& more) { return "</UWSimScene>\n" + more; };
  expect_refused("</UWSimScene>", after("\n  junk\n"), "junk", "found text 'junk', expected one <UWSimScene>");
  expect_refused("</UWSimScene>", after("<UWSimScene/>"), "<UWSimScene/>", "found a second root element <UWSimScene>");
  expect_refused("<UWSimScene>", "<!DOCTYPE UWSimScene [\n<!ENTITY a \"b\">\n]>\n<UWSimScene>", "<!DOCTYPE",
                 "found a DOCTYPE");
  expect_refused("<UWSimScene>", "junk\n<UWSimScene>", "junk", "found text 'junk'");
  EXPECT_NO_THROW(read(default_text() + "<!-- a comment -->\n"));
}

TEST(SceneFile, LightOneGivesThePapersBrightConditionAtTheLuxMeter) {
  EXPECT_NEAR(TankWorld::load(kEtc / "scenes/tank.xml", {}).lux(), 207, 3);
}

TEST(SceneFile, CameraAtAKnownPoseSeesAKnownPointAtItsPixel) {
  const Scene scene = read(
      replaced("<x>0.575</x><y>0.215</y><z>0.57</z></position>\n      "
               "<quaternion><x>0.397810856</x><y>-0.280376899</y><z>-0.584590789</z><w>0.649144766</w></quaternion>",
               "<x>-0.3</x><y>0</y><z>0.25</z></position>"));
  // b is (0.2, 0, 1.18) with z down, so c is at w (-0.1, 0, 0.93), looks straight down, its y along -y of w.
  const auto pixel = scene.cameras[1].model.project(scene.cameras[1].wMc.inverse() * Vector3d(0.0, -0.2, 0.43));
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), 315.7 + 765.4 * 0.1 / 0.5, 1e-6);
  EXPECT_NEAR(pixel->y(), 236.8 + 762.9 * 0.2 / 0.5, 1e-6);
}

TEST(SceneFile, MistakesAreToldWithTheirLine) {
  expect_refused("<lightRate>1.0<", "<lightRate>bright<", "<lightRate>", "found 'bright', expected a number in [0, 1]");
  expect_refused("<lightRate>1.0<", "<lightRate>1.5<", "<lightRate>", "found '1.5'");
  expect_refused("<halfAngle>1.0</halfAngle>", "<halfAngel>1</halfAngel>", "<halfAngel>", "nearest: <halfAngle>");
  expect_refused("<intensity>388</intensity>", "", "<lamp>", "found no <intensity>");
  expect_refused("<name>left</name>", "<name>mono</name> <!--2-->", "<!--2-->", "second camera called 'mono'");
}

TEST(SceneFile, DuplicateNamesMissingMeshesAndBrokenXmlAreRefused) {
  expect_refused("<name>starboard</name>", "<name>port</name> <!--2-->", "<!--2-->", "second lamp called 'port'");
  expect_refused("black_box.obj", "no_box.obj", "no_box.obj", "found no file");
  expect_refused("<depth>1.4</depth>", "<depth>1.4</depth><depth>1</depth>", "<depth>1.4", "second <depth>");
  expect_refused("<depth>1.4</depth>", "<depth>1.4</dept>", "</dept>", "does not parse");
}

TEST(SceneFile, WhatUwsimKnowsAndWeDoNotSimulateIsAWarningWithItsLine) {
  const std::string text = replaced("<oceanState>", "<oceanState>\n    <windx>0.04</windx>");
  const Scene scene = read(text);
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_THAT(scene.warnings[0], ::testing::HasSubstr(":" + std::to_string(line_of(text, "<windx>")) + ": <windx>"));
}

TEST(BlackBoxMesh, IsClosedOutwardAndHasItsOriginAtTheCentreOfTheTopFace) {
  std::ifstream in(kEtc / "objects/black_box.obj");
  std::vector<Vector3d> v;
  std::map<std::pair<int, int>, int> edges;
  double volume = 0;
  for (std::string line; std::getline(in, line);) {
    std::istringstream s(line);
    std::string kind;
    s >> kind;
    if (kind == "v") s >> v.emplace_back().x() >> v.back().y() >> v.back().z();
    if (kind != "f") continue;
    std::array<int, 3> f{};
    s >> f[0] >> f[1] >> f[2];
    for (int k = 0; k < 3; ++k) ++edges[{f[k], f[(k + 1) % 3]}];
    volume += v[f[0] - 1].dot(v[f[1] - 1].cross(v[f[2] - 1])) / 6;
  }
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ((edges.count({edge.second, edge.first})), 1u);
  }
  EXPECT_NEAR(volume, 0.14 * 0.30 * 0.16, 1e-12);
  for (const Vector3d& p : v) {
    EXPECT_DOUBLE_EQ(std::abs(p.x()), 0.07);
    EXPECT_DOUBLE_EQ(std::abs(p.y()), 0.15);
    EXPECT_TRUE(p.z() == 0 || p.z() == -0.16);
  }
}

TEST(SceneFile, HasBoardsThatAreShownCarriedOrLeanThere) {
  const Scene scene = read_scene(kEtc / "scenes/tank.xml");
  ASSERT_EQ(scene.boards.size(), 4U);
  EXPECT_EQ(scene.boards[0].place, BoardSpec::Place::kShown);
  EXPECT_EQ(scene.boards[0].shows.size(), 2U);
  EXPECT_EQ(scene.boards[1].place, BoardSpec::Place::kEndEffector);
  EXPECT_EQ(scene.boards[1].pattern.dictionary, "apriltag_36h11");
  for (const std::size_t leaning : {2U, 3U}) {
    EXPECT_EQ(scene.boards[leaning].place, BoardSpec::Place::kTank);
    EXPECT_LT((scene.arm.wMb.inverse() * scene.boards[leaning].pose).translation().z(), 1.0) << "above the floor";
  }
}

TEST(SceneFile, RefusesBoardsThatCannotBe) {
  const std::string shown = "<name>shown</name>\n    <pattern>charuco</pattern>";
  expect_refused(shown, "<name>shown</name>\n    <pattern>chess</pattern>", "<pattern>chess",
                 "found 'chess', expected checkerboard, charuco, markers, dots");
  expect_refused("<dictionary>apriltag_36h11</dictionary>", "<dictionary>5x7</dictionary>", "<pattern>markers",
                 "found dictionary '5x7', expected one of: 4x4_50");
  expect_refused("<columns>2</columns><rows>2</rows>", "<columns>40</columns><rows>40</rows>", "<pattern>markers",
                 "found 1600 markers from 0 on, expected at most the 587");
  expect_refused("<shown><camera>mono</camera>", "<shown><camera>fore</camera>", "<camera>fore",
                 "found 'fore', expected a camera of the scene");
  expect_refused("<hold>1.0</hold>", "<hold>1.0</hold><relativeTo>world</relativeTo>", "<relativeTo>world</relativeTo>",
                 "found <relativeTo> beside <shown>");
  expect_refused("<name>plate</name>", "<name>shown</name>", "<name>shown</name>\n    <pattern>markers",
                 "found a second board called 'shown'");
}

}  // namespace
}  // namespace tankrig::sim
