// Camera files of Kalibr, mrcal and ViSP, as these programs write them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/camera_file.hpp"
#include "core/input_error.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using testing::HasSubstr;

constexpr const char* kKalibr = R"(cam0:
  camera_model: pinhole
  intrinsics: [461.6, 460.3, 363.0, 248.1]
  distortion_model: radtan
  distortion_coeffs: [-0.27, 0.06, 0.001, -0.002]
  cam_overlaps: [1]
  T_cam_imu:
  - [0.0, 1.0, 0.0, 0.1]
  - [-1.0, 0.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  timeshift_cam_imu: -8.121e-05
  rostopic: /cam0/image_raw
  resolution: [752, 480]
cam1:
  camera_model: pinhole
  intrinsics: [460.6, 459.4, 369.1, 243.3]
  distortion_model: radtan
  distortion_coeffs: [-0.2725, 0.0565, -0.0001, 0.0003]
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.11]
  - [0.0, 1.0, 0.0, 0.002]
  - [0.0, 0.0, 1.0, 0.003]
  - [0.0, 0.0, 0.0, 1.0]
  resolution: [752, 480]
)";

constexpr const char* kMrcal = R"(# generated on 2024-05-01 with mrcal-calibrate-cameras
{
    'lensmodel':  'LENSMODEL_OPENCV5',
    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....
    'intrinsics': [ 533.1, 533.3, 342.2, 233.9, -0.28, 0.03, 0.001, -0.0002, 0.15,],
    'valid_intrinsics_region': [
    [ 0, 0 ],
    [ 639, 479 ],
    ],
    # extrinsics are rt_fromref
    'extrinsics': [ 0, 0, 1.5707963267948966, -0.1, 0.02, 0.03,],
    'imagersize': [ 640, 480,],
    'icam_intrinsics': 0,
    'optimization_inputs': b'DATA*wkg}pyk{+:5xE:J#Lo7PGMO_qXo;{g',
}
)";

constexpr const char* kVisp = R"(<?xml version="1.0"?>
<root>
  <camera>
    <!--Name of the camera-->
    <name>cam</name>
    <image_width>640</image_width>
    <image_height>480</image_height>
    <model>
      <type>perspectiveProjWithoutDistortion</type>
      <px>599</px><py>600</py><u0>321</u0><v0>241</v0>
    </model>
    <model>
      <type>perspectiveProjWithDistortion</type>
      <px>600</px><py>601</py><u0>320</u0><v0>240</v0>
      <kud>-0.2</kud>
      <kdu>0.21</kdu>
    </model>
  </camera>
</root>
)";

std::string edited(std::string text, const std::string& find, const std::string& replace) {
  const std::size_t at = text.find(find);
  EXPECT_NE(at, std::string::npos) << find;
  return text.replace(at, find.size(), replace);
}

TEST(CameraFormats, ReadsKalibrsCamchain) {
  const TemporaryFolder folder;
  const auto cameras = read_camera_file_whole(folder.write("camchain.yaml", kKalibr));
  ASSERT_EQ(cameras.size(), 2u);
  EXPECT_EQ(cameras[1].name, "cam1");
  EXPECT_EQ(cameras[1].model.width, 752);
  EXPECT_EQ(cameras[1].model.fy, 459.4);
  EXPECT_EQ(cameras[1].model.p2, 0.0003);
  EXPECT_EQ(cameras[1].cMr->translation(), Vector3d(-0.11, 0.002, 0.003));
  EXPECT_THAT(message_of<InputError>([&] { read_camera_file(folder.path() / "camchain.yaml"); }),
              HasSubstr("found 2 cameras (cam0, cam1), expected one"));
}

TEST(CameraFormats, ReadsMrcalsCameraModel) {
  const TemporaryFolder folder;
  const auto cameras = read_camera_file_whole(folder.write("left.cameramodel", kMrcal));
  ASSERT_EQ(cameras.size(), 1u);
  EXPECT_EQ(cameras[0].name, "left");
  EXPECT_EQ(cameras[0].model.cy, 233.9);
  EXPECT_EQ(cameras[0].model.k3, 0.15);
  EXPECT_TRUE((*cameras[0].cMr * Vector3d(1, 0, 0)).isApprox(Vector3d(-0.1, 1.02, 0.03), 1e-12));
}

TEST(CameraFormats, ReadsVispsModelWithDistortion) {
  const TemporaryFolder folder;
  const CameraModel c = read_camera_file(folder.write("cam.xml", kVisp));
  EXPECT_EQ(c.height, 480);
  EXPECT_EQ(c.fx, 600);
  EXPECT_EQ(c.k1, -0.2);
  EXPECT_EQ(c.k2, 0);
}

TEST(CameraFormats, ReadBackExactlyWhatIsWritten) {
  const TemporaryFolder folder;
  CameraModel model{640, 480, 1600 / 3.0, 561.1, 2333.0 / 7, 1e3 / 4.2, -0.28 / 3, 1e-10, 0.001 / 3, -7e-4, 0.15};
  Transform cMr = make_transform_rpy({-0.1, 1e-9, 0.003}, {0.01, -0.03, 0.005});
  for (const auto format : {CameraFileFormat::kRos, CameraFileFormat::kOpenCv, CameraFileFormat::kOpenCvXml,
                            CameraFileFormat::kMrcal, CameraFileFormat::kKalibr, CameraFileFormat::kVisp}) {
    if (format == CameraFileFormat::kKalibr) model.k3 = 0;
    if (format == CameraFileFormat::kVisp) model.k2 = model.p1 = model.p2 = 0;
    const auto file = folder.path() / name_of(format);
    write_camera_file(file, format, {{"left", model, cMr, {}}});
    const FileCamera back = read_camera_file_whole(file).front();
    for (const auto member : {&CameraModel::fx, &CameraModel::fy, &CameraModel::cx, &CameraModel::cy, &CameraModel::k1,
                              &CameraModel::k2, &CameraModel::p1, &CameraModel::p2, &CameraModel::k3})
      EXPECT_EQ(back.model.*member, model.*member) << name_of(format);
    EXPECT_EQ(back.model.width, model.width);
    if (format == CameraFileFormat::kMrcal) {
      EXPECT_TRUE(back.cMr->isApprox(cMr, 1e-14));
    }
  }
}

TEST(CameraFormats, ACamchainKeepsWhereItsCamerasStand) {
  const TemporaryFolder folder;
  const auto first = read_camera_file_whole(folder.write("a.yaml", kKalibr));
  write_camera_file(folder.path() / "b.yaml", CameraFileFormat::kKalibr, first);
  const auto second = read_camera_file_whole(folder.path() / "b.yaml");
  ASSERT_EQ(second.size(), 2u);
  EXPECT_TRUE(second[1].cMr->isApprox(*first[1].cMr, 1e-15));
}

TEST(CameraFormats, RefuseALensTheyHaveNoPlaceFor) {
  const TemporaryFolder folder;
  const CameraModel model{640, 480, 530, 560, 331, 246, -0.28, 0.09, 0, 0, 0.01};
  const auto refusal = [&](CameraFileFormat format) {
    return message_of<InputError>([&] { write_camera_file(folder.path() / "c", format, {{"left", model, {}, {}}}); });
  };
  EXPECT_THAT(refusal(CameraFileFormat::kKalibr),
              HasSubstr("found k3 = 0.01, for which the format kalibr has no place"));
  EXPECT_THAT(refusal(CameraFileFormat::kVisp), HasSubstr("found k2 = 0.09, k3 = 0.01, for which the format visp"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "c"));
}

/// Our own format: a model as in a rig file.
const std::string kOwnFormat =
    "name: \"mono\"\n"
    "model: {width_px: 640, height_px: 480, fx_px: 530, fy_px: 531, cx_px: 320, cy_px: 240,\n"
    "        port: {distance_m: 0.045, thickness_m: 0.01, normal: [0, 0.6, 0.8], index_water: 1.34}}\n";

TEST(CameraFormats, OurOwnHoldsAFlatPort) {
  const TemporaryFolder folder;
  const FileCamera camera = read_camera_file_whole(folder.write("a.yaml", kOwnFormat)).front();
  EXPECT_EQ(camera.name, "mono");
  ASSERT_TRUE(camera.model.port);
  EXPECT_EQ(camera.model.port->distance, 0.045);
  EXPECT_EQ(camera.model.port->normal, Vector3d(0, 0.6, 0.8));
  EXPECT_EQ(camera.model.port->water, 1.34);
  EXPECT_EQ(camera.model.port->glass, 1.49) << "if nothing else is said";
  CameraModel model = camera.model;
  model.port->normal = Vector3d(0.1, -0.03, 1 / 3.0).normalized();
  const auto file = folder.path() / "b.yaml";
  write_camera_file(file, CameraFileFormat::kTankrig, {{"mono", model, {}, {}}});
  const CameraModel back = read_camera_file(file);
  EXPECT_EQ(back.port->normal, model.port->normal);
  EXPECT_EQ(yaml_of(back), yaml_of(model));
}

TEST(CameraFormats, OfOthersRefuseAFlatPort) {
  const TemporaryFolder folder;
  const CameraModel model = read_camera_file(folder.write("a.yaml", kOwnFormat));
  for (const auto format : {CameraFileFormat::kRos, CameraFileFormat::kOpenCv, CameraFileFormat::kOpenCvXml,
                            CameraFileFormat::kMrcal, CameraFileFormat::kKalibr, CameraFileFormat::kVisp})
    EXPECT_THAT(message_of<InputError>([&] {
                  write_camera_file(folder.path() / "c", format, {{"mono", model, {}, {}}});
                }),
                HasSubstr(std::string("mono: found a flat port, for which the format ") + name_of(format) +
                          " has no place, expected the format tankrig"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "c"));
  std::filesystem::create_directory(folder.path() / "cameras");
  write_camera_files(folder.path() / "cameras", model, "mono");
  EXPECT_TRUE(read_camera_file(folder.path() / "cameras/mono.yaml").port);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "cameras/mono.opencv.yml"));
}

TEST(CameraFormats, NameTheLineOfABadPort) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& find, const std::string& replace) {
    return message_of<InputError>([&] { read_camera_file(folder.write("c", edited(kOwnFormat, find, replace))); });
  };
  EXPECT_THAT(error("distance_m: 0.045, ", ""),
              HasSubstr("c:3: model.port.distance_m: found nothing, expected a number from 0 to 1"));
  EXPECT_THAT(error("0.045", "45"), HasSubstr("c:3: model.port.distance_m: found '45'"));
  EXPECT_THAT(error("0.045", "-0.001"), HasSubstr("c:3: model.port.distance_m: found '-0.001'"));
  EXPECT_THAT(error("[0, 0.6, 0.8]", "[0, 0, 0]"), HasSubstr("c:3: model.port.normal: found length 0"));
  EXPECT_THAT(error("[0, 0.6, 0.8]", "[0, 0.6, .nan]"), HasSubstr("c:3: model.port.normal: found"));
  EXPECT_THAT(error("[0, 0.6, 0.8]", "[0, 0, -1]"), HasSubstr("found pixels that do not look through it"));
  EXPECT_THAT(error("index_water: 1.34", "index_water: 134"), HasSubstr("c:3: model.port.index_water: found '134'"));
  EXPECT_THAT(error("index_water", "water"), HasSubstr("c:3: model.port.water"));
}

TEST(CameraFormats, NameFileLineAndFieldOfBadInput) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& text) {
    return message_of<InputError>([&] { read_camera_file_whole(folder.write("c", text)); });
  };
  EXPECT_THAT(error(edited(kKalibr, "pinhole", "omni")), HasSubstr("c:2: cam0.camera_model: found 'omni'"));
  EXPECT_THAT(error(edited(kKalibr, "radtan", "equidistant")), HasSubstr("expected radtan or none"));
  EXPECT_THAT(error(edited(kKalibr, "[461.6, 460.3, 363.0, 248.1]", "[461.6]")),
              HasSubstr("c:3: cam0.intrinsics: found 1 numbers, expected 4"));
  EXPECT_THAT(error(edited(kKalibr, "T_cn_cnm1", "T_other")), HasSubstr("cam1.T_cn_cnm1: missing"));
  EXPECT_THAT(error(edited(kKalibr, "[1.0, 0.0, 0.0, -0.11]", "[1.5, 0.0, 0.0, -0.11]")),
              HasSubstr("no rotation and translation"));
  EXPECT_THAT(error(edited(kMrcal, "OPENCV5", "SPLINED")), HasSubstr("found 'LENSMODEL_SPLINED'"));
  EXPECT_THAT(error(edited(kMrcal, "OPENCV5", "OPENCV4")), HasSubstr("intrinsics: found 9 numbers, expected 8"));
  EXPECT_THAT(error(edited(kMrcal, "'imagersize'", "'size'")), HasSubstr("imagersize"));
  EXPECT_THAT(error(edited(kMrcal, "'lensmodel'", "lensmodel'")), HasSubstr("c:"));
  EXPECT_THAT(error(edited(kVisp, "<px>600</px>", "")), HasSubstr("c:12: px: missing"));
  EXPECT_THAT(error(edited(kVisp, "<kud>-0.2</kud>", "<kud>-9e9</kud>")), HasSubstr("c:15: kud: found k1 = -9"));
  EXPECT_THAT(error("<root></root>"), HasSubstr("found no <camera>"));
  EXPECT_THAT(error(edited(kVisp, "</root>", "")), HasSubstr("found XML that does not parse"));
}

}  // namespace
}  // namespace tankrig
