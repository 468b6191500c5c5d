// Whole frames: reproducible, seeded, composed in the right order.
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <fstream>
#include <sstream>
#include <string>

#include "core/input_error.hpp"
#include "tests/world/render_scene.hpp"

namespace tankrig::sim {
namespace {

using testing::full_scene;
using testing::small_scene;
using testing::still;

bool same(const cv::Mat& a, const cv::Mat& b) { return a.size() == b.size() && cv::norm(a, b, cv::NORM_INF) == 0; }

cv::Mat with_threads(std::size_t threads, const Scene& scene, const WorldOptions& options) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  return TankWorld::from_scene(scene, options).render("mono", still(scene, 1));
}

TEST(RenderWorld, GivesTheSameBytesWhateverTheThreadCount) {
  const Scene scene = small_scene();
  for (const char* sensor : {"gaussian", "emva1288"}) {
    WorldOptions options;
    options.noise = 0.03;
    options.sensor = sensor;
    EXPECT_TRUE(same(with_threads(1, scene, options), with_threads(2, scene, options))) << sensor;
  }
}

TEST(RenderWorld, ServesManyThreadsFromTheFirstFrameOn) {
  const Scene scene = small_scene();
  const TankWorld sut = TankWorld::from_scene(scene, {});
  std::array<cv::Mat, 8> images;
  tbb::parallel_for(0, 8, [&](int i) { images[i] = sut.render(i % 2 ? "left" : "right", still(scene, 1)); });
  for (int i = 2; i < 8; ++i) EXPECT_TRUE(same(images[i], images[i - 2]));
}

TEST(RenderWorld, DrawsOtherNoiseForAnotherSeedOrFrame) {
  const Scene scene = small_scene();
  WorldOptions options;
  options.noise = 0.02;
  const TankWorld sut = TankWorld::from_scene(scene, options);
  Exposure exposure = still(scene, 1);
  const cv::Mat first = sut.render("mono", exposure);
  EXPECT_TRUE(same(first, sut.render("mono", exposure)));
  exposure.index = 1;
  EXPECT_FALSE(same(first, sut.render("mono", exposure)));
  options.seed = 2;
  EXPECT_FALSE(same(first, TankWorld::from_scene(scene, options).render("mono", still(scene, 1))));
}

TEST(RenderWorld, LayersExposedAtAnotherLightAndNoiseAreThatWorldsFrameToTheBit) {
  Scene scene = small_scene();
  scene.water.particles_per_m3 = 3000;  // some show at full light alone
  for (const char* sensor : {"gaussian", "emva1288"}) {
    WorldOptions options;
    options.sensor = sensor;
    const TankWorld sut = TankWorld::from_scene(scene, options);
    for (const double laser : {0.0, 1.0}) {
      const Exposure exposure = still(scene, laser);
      const auto layers = sut.layers("mono", exposure);
      for (const auto& [light, noise] : {std::pair{0.0, 0.0}, {0.35, 0.0}, {0.35, 0.06}, {1.0, 0.1}}) {
        options.light = light;
        options.noise = noise;
        EXPECT_TRUE(
            same(sut.expose(*layers, light, noise), TankWorld::from_scene(scene, options).render("mono", exposure)))
            << sensor << " laser " << laser << " light " << light << " noise " << noise;
      }
    }
  }
}

TEST(RenderWorld, AddsNothingButTheLasersLightWhenItSwitchesOn) {
  Scene scene = small_scene();
  scene.water.particles_per_m3 = 0;
  const TankWorld sut = TankWorld::from_scene(scene, {});
  const cv::Mat off = sut.render("mono", still(scene, 0)), on = sut.render("mono", still(scene, 1));
  cv::Mat less;
  cv::subtract(off, on, less);
  EXPECT_EQ(cv::norm(less, cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(on, off, cv::NORM_INF), 100);
}

TEST(RenderWorld, LooksLikeTheTankAtLightOne) {
  const Scene scene = full_scene();
  const cv::Mat image = TankWorld::from_scene(scene, {}).render("left", still(scene, 0));
  const CameraSpec& camera = scene.cameras[1];
  const auto mean_near = [&](const Vector3d& p) {
    const auto pixel = *camera.model.project(camera.wMc.inverse() * p);
    const cv::Rect window(static_cast<int>(pixel.x()) - 12, static_cast<int>(pixel.y()) - 12, 25, 25);
    return cv::mean(image(window))[1];
  };
  EXPECT_NEAR(mean_near({-0.18, -0.12, 0}), 125, 25);
  EXPECT_NEAR(mean_near(scene.objects[0].wMo * Vector3d(0, 0, 0)), 35, 13);
}

/// The triangles of a box made by testing::write_box(), as Collada whose z axis is up.
std::filesystem::path as_collada(const std::filesystem::path& box, testing::TemporaryFiles& files) {
  std::ifstream in(box);
  std::string vertices, corners;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line.substr(1));
    if (line[0] == 'v') vertices += words.str() + " ";
    int a = 0, b = 0, c = 0, d = 0;
    if (line[0] == 'f' && words >> a >> b >> c >> d)
      for (const int corner : {a, b, c, a, c, d}) corners += std::to_string(corner - 1) + " ";
  }
  const auto file = files.add("box.dae");
  std::ofstream(file) << R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="s"><float_array id="f" count="24">)"
                      << vertices << R"(</float_array>
<technique_common><accessor source="#f" count="8" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#s"/></vertices>
<triangles count="12"><input semantic="VERTEX" source="#v" offset="0"/><p>)"
                      << corners << R"(</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="scene"><node><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#scene"/></scene>
</COLLADA>)";
  return file;
}

TEST(RenderWorld, ShowsAColladaMeshByTheAxesInItsFile) {
  testing::TemporaryFiles files;
  Scene scene = small_scene();
  const cv::Mat by_obj = TankWorld::from_scene(scene, {}).render("left", still(scene, 0));
  scene.objects[0].mesh = as_collada(scene.objects[0].mesh, files);
  const cv::Mat by_collada = TankWorld::from_scene(scene, {}).render("left", still(scene, 0));
  EXPECT_EQ(cv::norm(by_obj, by_collada, cv::NORM_INF), 0);
}

TEST(RenderWorld, HidesTheSceneBehindTheArm) {
  Scene scene = small_scene();
  scene.water.particles_per_m3 = 0;
  const TankWorld without = TankWorld::from_scene(scene, {});
  // The camera looks along the forearm from beyond the elbow: the arm fills the middle of the image.
  const Transform wMe = scene.arm.wMb * scene.arm.model.bMe(scene.arm.q);
  scene.cameras[1].wMc = testing::look_at(wMe * Vector3d(0.4, 0, -0.3), wMe * Vector3d(0, 0, -0.3));
  const TankWorld sut = TankWorld::from_scene(scene, {});
  const cv::Mat image = sut.render("left", still(scene, 0));
  const cv::Vec3b middle = image.at<cv::Vec3b>(image.rows / 2, image.cols / 2);
  EXPECT_GT(middle[2], middle[0]) << "a yellow arm";
  Exposure away = still(scene, 0);
  for (JointVector& q : away.q) q << -1.4, 0.12, 0.1, 0, 0;
  const cv::Mat clear = sut.render("left", away);
  EXPECT_GT(cv::norm(image.at<cv::Vec3b>(image.rows / 2, image.cols / 2),
                     clear.at<cv::Vec3b>(image.rows / 2, image.cols / 2)),
            20);
}

TEST(RenderWorld, RendersOneChannelForAGreyCamera) {
  Scene scene = small_scene();
  scene.cameras[0].channels = 1;
  const cv::Mat image = TankWorld::from_scene(scene, {}).render("mono", still(scene, 1));
  EXPECT_EQ(image.type(), CV_8UC1);
  EXPECT_GT(cv::mean(image)[0], 20);
}

TEST(RenderWorld, NamesTheCamerasItHasWhenAskedForAnother) {
  const Scene scene = small_scene();
  const TankWorld sut = TankWorld::from_scene(scene, {});
  try {
    static_cast<void>(sut.render("top", still(scene, 0)));
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("mono, left, right"), std::string::npos) << e.what();
  }
}

TEST(RenderWorld, RefusesOptionsOutOfRange) {
  WorldOptions light, noise, sensor;
  light.light = 1.5;
  noise.noise = -0.1;
  sensor.sensor = "poisson";
  for (const WorldOptions& options : {light, noise, sensor})
    EXPECT_THROW(TankWorld::from_scene(small_scene(), options), InputError);
}

TEST(RenderWorld, RefusesAMeshThatIsNotThere) {
  Scene scene = small_scene();
  scene.objects[0].mesh = "/nowhere/box.obj";
  EXPECT_THROW(TankWorld::from_scene(scene, {}), InputError);
}

TEST(RenderWorld, DescribesItsSensorForTheSession) {
  WorldOptions options;
  options.noise = 0.02;
  EXPECT_EQ(TankWorld::from_scene(small_scene(), options).noise_description(),
            "gaussian: additive sd 0.02 of full scale");
}

TEST(RenderWorld, DrawsTheRigFromOutside) {
  const Scene scene = small_scene();
  const TankWorld sut = TankWorld::from_scene(scene, {});
  const cv::Mat with = sut.render_external(scene.arm.q, true, 240, 180),
                without = sut.render_external(scene.arm.q, false, 240, 180);
  EXPECT_EQ(with.size(), cv::Size(240, 180));
  cv::Mat difference, greener;
  cv::subtract(with, without, difference);
  cv::extractChannel(difference, greener, 1);
  EXPECT_GT(cv::countNonZero(greener > 15), 100) << "the fan and its line";
}

}  // namespace
}  // namespace tankrig::sim
