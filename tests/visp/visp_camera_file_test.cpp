// Camera files for ViSP, in the eyes of ViSP's own parser.
#include <gtest/gtest.h>
#include <visp3/core/vpMeterPixelConversion.h>
#include <visp3/core/vpPixelMeterConversion.h>
#include <visp3/core/vpXmlParserCamera.h>

#include "core/camera_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

constexpr auto kDistorted = vpCameraParameters::perspectiveProjWithDistortion;

TEST(VispCameraFile, IsReadByItsParserAndProjectsAlike) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "camera.xml";
  const CameraModel ours{640, 480, 530.1, 560.3, 331.7, 246.2, -0.18, 0, 0, 0, 0};
  write_camera_file(file, CameraFileFormat::kVisp, {{"left", ours, {}, {}}});
  vpCameraParameters theirs;
  vpXmlParserCamera parser;
  ASSERT_EQ(parser.parse(theirs, file.string(), "left", kDistorted, 640, 480), vpXmlParserCamera::SEQUENCE_OK);
  EXPECT_EQ(theirs.get_px(), ours.fx);
  for (const Vector3d& p : {Vector3d(0.3, -0.2, 1), Vector3d(-0.5, 0.4, 1), Vector3d(0, 0, 1)}) {
    double u = 0, v = 0;
    vpMeterPixelConversion::convertPoint(theirs, p.x(), p.y(), u, v);
    EXPECT_LT((ours.project(p).value() - Vector2d(u, v)).norm(), 1e-9);
    // Their way back is a fit of one term.
    double x = 0, y = 0;
    vpPixelMeterConversion::convertPoint(theirs, u, v, x, y);
    EXPECT_LT((Vector2d(x, y) - p.head<2>()).norm(), 0.006);
  }
}

TEST(VispCameraFile, OfItsParserIsRead) {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "camera.xml").string();
  vpCameraParameters theirs;
  theirs.initPersProjWithDistortion(1600 / 3.0, 601.25, 320.5, 240.25, -0.2 / 3, 0.07);
  vpXmlParserCamera parser;
  ASSERT_EQ(parser.save(theirs, file, "left", 640, 480), vpXmlParserCamera::SEQUENCE_OK);
  const FileCamera camera = read_camera_file_whole(file).front();
  EXPECT_EQ(camera.name, "left");
  EXPECT_EQ(camera.model.width, 640);
  EXPECT_EQ(camera.model.fx, theirs.get_px());
  EXPECT_EQ(camera.model.cy, theirs.get_v0());
  EXPECT_EQ(camera.model.k1, theirs.get_kud());
}

}  // namespace
}  // namespace tankrig
