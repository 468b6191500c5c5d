// Camera files as OpenCV and ROS write them.
#include "core/camera_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <opencv2/core.hpp>

#include "core/camera_model.hpp"
#include "core/input_error.hpp"
#include "core/model_yaml.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;

constexpr const char* kOpenCv = R"(%YAML:1.0
---
calibration_Time: "Tue 02 May 2017"
image_width: 640
image_height: 480
Camera_Matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.14e+02, 0., 3.29e+02, 0., 685.5, 237., 0., 0., 1. ]
Distortion_Coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -0.35, 0.158, 7.3e-04, -2.31e-04, .01 ]
)";

constexpr const char* kRos = R"(image_width: 640
image_height: 480
camera_name: head
camera_matrix:
  rows: 3
  cols: 3
  data: [765.4, 0, 315.7, 0, 762.9, 236.8, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.3745, 0.1606, 0.00096, -6e-6, 0]
)";

constexpr const char* kXml = R"(<?xml version="1.0"?>
<opencv_storage>
<calibration_Time>"Tue 02 May 2017"</calibration_Time>
<image_width>640</image_width>
<image_height>480</image_height>
<Camera_Matrix type_id="opencv-matrix">
  <rows>3</rows>
  <cols>3</cols>
  <dt>d</dt>
  <data>
    5.14e+02 0. 3.29e+02 0.
    685.5 237. 0. 0. 1.</data></Camera_Matrix>
<Distortion_Coefficients type_id="opencv-matrix">
  <rows>5</rows>
  <cols>1</cols>
  <dt>d</dt>
  <data>
    -0.35 0.158 7.3e-04 <!-- tangential --> -2.31e-04 .01</data></Distortion_Coefficients>
</opencv_storage>
)";

std::string changed(std::string text, const std::string& find, const std::string& replace) {
  const std::size_t at = text.find(find);
  EXPECT_NE(at, std::string::npos) << find;
  return text.replace(at, find.size(), replace);
}

TEST(CameraFile, ReadsOpenCvCalibrations) {
  const TemporaryFolder folder;
  const CameraModel c = read_camera_file(folder.write("c.yaml", kOpenCv));
  EXPECT_EQ(c.width, 640);
  EXPECT_EQ(c.height, 480);
  EXPECT_EQ(c.fx, 514);
  EXPECT_EQ(c.fy, 685.5);
  EXPECT_EQ(c.cx, 329);
  EXPECT_EQ(c.cy, 237);
  EXPECT_EQ(c.k1, -0.35);
  EXPECT_EQ(c.k2, 0.158);
  EXPECT_EQ(c.p1, 7.3e-4);
  EXPECT_EQ(c.p2, -2.31e-4);
  EXPECT_EQ(c.k3, 0.01);
}

TEST(CameraFile, KnowsTheNamesPeopleUse) {
  const TemporaryFolder folder;
  for (const char* name : {"camera_matrix", "cameraMatrix", "K"})
    EXPECT_EQ(read_camera_file(folder.write("c.yaml", changed(kOpenCv, "Camera_Matrix", name))).fy, 685.5);
  for (const char* name : {"distortion_coefficients", "D"})
    EXPECT_EQ(read_camera_file(folder.write("c.yaml", changed(kOpenCv, "Distortion_Coefficients", name))).k2, 0.158);
  EXPECT_EQ(
      read_camera_file(
          folder.write("c.yaml", "image_size: [6, 5]\nK: [[10, 0, 2], [0, 30, 4], [0, 0, 1]]\nD: [0, 0, 0, 0.01]\n"))
          .p2,
      0.01);
}

TEST(CameraFile, ReadsOpenCvsXmlAsItsYaml) {
  const TemporaryFolder folder;
  const CameraModel yaml = read_camera_file(folder.write("c.yaml", kOpenCv));
  std::string windows = kXml;
  for (std::size_t at = 0; (at = windows.find('\n', at)) != std::string::npos; at += 2) windows.replace(at, 1, "\r\n");
  for (const std::string& text : {std::string(kXml), windows, std::string("\xef\xbb\xbf") + kXml}) {
    const CameraModel xml = read_camera_file(folder.write("c.any", text));
    EXPECT_EQ(yaml_of(xml), yaml_of(yaml)) << "whatever the file is called";
  }
  for (const char* name : {"camera_matrix", "cameraMatrix", "CameraMatrix", "K"}) {
    std::string text = changed(kXml, "<Camera_Matrix", std::string("<") + name);
    text = changed(text, "</Camera_Matrix", std::string("</") + name);
    EXPECT_EQ(read_camera_file(folder.write("c.xml", text)).fy, 685.5) << name;
  }
  for (const char* name : {"distortion_coefficients", "distCoeffs", "dist_coeffs", "D"}) {
    std::string text = changed(kXml, "<Distortion_Coefficients", std::string("<") + name);
    text = changed(text, "</Distortion_Coefficients", std::string("</") + name);
    EXPECT_EQ(read_camera_file(folder.write("c.xml", text)).k3, 0.01) << name;
  }
}

TEST(CameraFile, ReadsWhatOpenCvsFileStorageWrites) {
  const TemporaryFolder folder;
  for (const char* name : {"c.xml", "c.yml"}) {
    const std::string file = (folder.path() / name).string();
    {
      cv::FileStorage out(file, cv::FileStorage::WRITE);
      out << "calibration_time"
          << "Tue 02 May 2017"
          << "image_size" << cv::Size(640, 480) << "distortion_model"
          << "plumb_bob"
          << "K" << cv::Mat(cv::Matx33d(514.4, 0, 329.8, 0, 685.9, 237.7, 0, 0, 1)) << "D"
          << "[" << -0.35 << 0.158 << 7.3e-4 << -2.31e-4 << "]";
    }
    const CameraModel c = read_camera_file(file);
    EXPECT_EQ(c.width, 640) << name;
    EXPECT_EQ(c.height, 480) << name;
    EXPECT_EQ(c.fx, 514.4) << name;
    EXPECT_EQ(c.cy, 237.7) << name;
    EXPECT_EQ(c.p2, -2.31e-4) << name;
  }
  const std::string rows =
      "<opencv_storage><image_size>6 5</image_size><D>0 0 0 0.01</D>"
      "<K><_>10 0 2</_><_>0 30 4</_><_>0 0 1</_></K></opencv_storage>";
  EXPECT_EQ(read_camera_file(folder.write("c.xml", rows)).fy, 30);
}

TEST(CameraFile, NamesFileLineAndFieldOfBadXml) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& text) {
    const std::string found = message_of<InputError>([&] { read_camera_file(folder.write("c.xml", text)); });
    EXPECT_EQ(found.find('\n'), std::string::npos) << found;
    EXPECT_LT(found.size(), 400u);
    return found;
  };
  EXPECT_THAT(error(changed(kXml, "<image_width>640</image_width>\n", "")),
              HasSubstr("c.xml: image_width: missing, expected the size of the calibrated image [px]"));
  EXPECT_THAT(error(changed(kXml, "640", "wide")), HasSubstr("c.xml:4: image_width: found 'wide', expected a number"));
  EXPECT_THAT(error(changed(kXml, "640", "")), HasSubstr("c.xml:4: image_width: found '', expected a number"));
  EXPECT_THAT(error(changed(kXml, "685.5", "fast")), HasSubstr("c.xml:12: Camera_Matrix.data: found 'fast', expected"));
  EXPECT_THAT(error(changed(kXml, " 237. ", " ")),
              HasSubstr("c.xml:10: Camera_Matrix.data: found 8 numbers, expected rows x cols = 9"));
  EXPECT_THAT(error(changed(kXml, "685.5", "-685.5")),
              HasSubstr("c.xml:6: Camera_Matrix: found fy = -685.5, expected a number from 1e-09 to"));
  EXPECT_THAT(error(changed(kXml, "5.14e+02 0.", "5.14e+02 2.")), HasSubstr("c.xml:6: Camera_Matrix: found skew"));
  EXPECT_THAT(error(changed(kXml, "-0.35", "-3")), HasSubstr("distortion folds over within the image"));
  EXPECT_THAT(
      error(changed(kXml, "</opencv_storage>\n", "")),
      ContainsRegex("c.xml:[0-9]+: found XML that does not parse .+, expected a camera calibration in OpenCV's"));
  EXPECT_THAT(error("<roots>\n<camera/></roots>"),
              HasSubstr("c.xml:1: found root element <roots>, expected <opencv_storage>"));
  EXPECT_THAT(error(std::string("<opencv_storage>\n\0</opencv_storage>", 35)), HasSubstr("c.xml:2: found a byte 0"));
  std::string deep = "<opencv_storage><K>";
  for (int i = 0; i < 20000; ++i) deep += "<_>";
  for (int i = 0; i < 20000; ++i) deep += "</_>";
  EXPECT_THAT(error(deep + "</K><image_size>6 5</image_size></opencv_storage>"),
              HasSubstr("c.xml:1: K: found '', expected a number"));
}

TEST(CameraFile, RefusesADistortionThatFoldsOver) {
  const TemporaryFolder folder;
  EXPECT_THAT(message_of<InputError>([&] { read_camera_file(folder.write("c.yaml", changed(kRos, "-0.3745", "-3"))); }),
              HasSubstr("c.yaml: distortion folds over within the image"));
}

TEST(CameraFile, ReadsRosCameraInfo) {
  const TemporaryFolder folder;
  EXPECT_EQ(read_camera_file(folder.write("c.yaml", kRos)).k1, -0.3745);
  const std::string rational = changed(changed(kRos, "plumb_bob", "rational_polynomial"), "cols: 5", "cols: 8");
  EXPECT_EQ(read_camera_file(folder.write("c.yaml", changed(rational, "-6e-6, 0]", "-6e-6, 0, 0, 0, 0]"))).k1, -0.3745);
  EXPECT_THAT(message_of<InputError>([&] {
                read_camera_file(folder.write("c.yaml", changed(rational, "-6e-6, 0]", "-6e-6, 0, 1, 0, 0]")));
              }),
              HasSubstr("c.yaml:10: distortion_coefficients: found a coefficient beyond k3"));
}

TEST(CameraFile, ReadsBackExactlyWhatItWrites) {
  const TemporaryFolder folder;
  const CameraModel a{720, 576, 626.08 / 3, 682.78, 368.93, 284.83, -0.37, 0.174, -0.0016, 0.0029, 1e-17};
  write_camera_file(folder.path() / "c.yaml", a, "mono");
  const CameraModel b = read_camera_file(folder.path() / "c.yaml");
  EXPECT_EQ(yaml_of(a), yaml_of(b));
  EXPECT_THAT(message_of<InputError>([&] { write_camera_file(folder.path() / "no/c.yaml", a, "mono"); }),
              HasSubstr("cannot be written"));
}

TEST(CameraFile, NamesFileLineAndFieldOfBadInput) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& text) {
    return message_of<InputError>([&] { read_camera_file(folder.write("c.yaml", text)); });
  };
  EXPECT_THAT(message_of<InputError>([&] { read_camera_file(folder.path() / "none.yaml"); }),
              HasSubstr("none.yaml: cannot be read"));
  EXPECT_THAT(error(changed(kOpenCv, "image_width: 640\n", "")),
              HasSubstr("c.yaml: image_width: missing, expected the size of the calibrated image [px]"));
  EXPECT_THAT(error(changed(kOpenCv, "640", "wide")),
              HasSubstr("c.yaml:4: image_width: found 'wide', expected a number"));
  EXPECT_THAT(error(changed(kOpenCv, "640", "640.5")), HasSubstr("expected a whole number of pixels"));
  EXPECT_THAT(error(changed(kOpenCv, "Camera_Matrix", "Kamera")), HasSubstr("c.yaml: camera_matrix: missing"));
  EXPECT_THAT(error(changed(kOpenCv, "Distortion_", "")), HasSubstr("c.yaml: distortion_coefficients: missing"));
  EXPECT_THAT(error(changed(kOpenCv, "0., 0., 1. ]", "0., 1. ]")),
              HasSubstr("c.yaml:10: Camera_Matrix.data: found 8 numbers, expected rows x cols = 9"));
  EXPECT_THAT(error(changed(kOpenCv, "685.5", "-685.5")),
              HasSubstr("c.yaml:6: Camera_Matrix: found fy = -685.5, expected a number from 1e-09 to"));
  EXPECT_THAT(error(changed(kOpenCv, "5.14e+02, 0.", "5.14e+02, 2.")), HasSubstr("found skew"));
  EXPECT_THAT(error(changed(kRos, "plumb_bob", "equidistant")),
              HasSubstr("c.yaml:8: distortion_model: found 'equidistant', expected plumb_bob"));
  EXPECT_THAT(error("a: [1\nb: 2\n"), ContainsRegex("c.yaml:[0-9]+: .+, expected a camera calibration in YAML$"));
  EXPECT_THAT(error("just text"), HasSubstr("c.yaml:1: found no mapping, expected a camera calibration in YAML"));
  std::string bytes("\x89PNG\r\n\x1a\n\0\0", 10);
  for (int i = 0; i < 4096; ++i) bytes += static_cast<char>(i * 167 >> 3);
  const std::string binary = error(bytes);
  EXPECT_THAT(binary, ContainsRegex("c.yaml:[0-9]+: .+, expected a camera calibration in YAML$"));
  EXPECT_LT(binary.size(), 300u);
  EXPECT_EQ(binary.find('\n'), std::string::npos) << "one line";
  EXPECT_LT(error(changed(kOpenCv, "640", std::string(5000, '9'))).size(), 300u);
}

TEST(CameraFile, RefusesACameraThatCannotBe) {
  const TemporaryFolder folder;
  const auto error = [&](const char* find, const char* replace) {
    return message_of<InputError>([&] { read_camera_file(folder.write("c.yaml", changed(kRos, find, replace))); });
  };
  EXPECT_THAT(error("765.4", "0"), HasSubstr("camera_matrix: found fx = 0, expected"));
  EXPECT_THAT(error("762.9", "1.1e5"), HasSubstr("camera_matrix: found fy = 110000, expected"));
  EXPECT_THAT(error("315.7", "-10001"), HasSubstr("camera_matrix: found cx = -10001, expected"));
  EXPECT_THAT(error("236.8", "100001"), HasSubstr("camera_matrix: found cy = 100001, expected"));
  EXPECT_THAT(error("-0.3745", "101"), HasSubstr("distortion_coefficients: found k1 = 101, expected"));
  EXPECT_THAT(error("0.1606", "-101"), HasSubstr("distortion_coefficients: found k2 = -101, expected"));
  EXPECT_THAT(error("0.00096", "11"), HasSubstr("distortion_coefficients: found p1 = 11, expected"));
  EXPECT_THAT(error("-6e-6, 0]", "-11, 0]"), HasSubstr("distortion_coefficients: found p2 = -11, expected"));
  EXPECT_THAT(error("-6e-6, 0]", "-6e-6, 101]"), HasSubstr("distortion_coefficients: found k3 = 101, expected"));
}

constexpr CameraModel kOdd{640, 481, 514.123456789012345, 685.5, 1.0 / 3, 237, -0.35, 0.158, 7.3e-4, -1e-17, 0.01};

TEST(CameraFile, WrittenForOpenCvIsReadByItsFileStorage) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "c.opencv.yml";
  write_opencv_camera_file(file, kOdd, "mono");
  const cv::FileStorage storage(file.string(), cv::FileStorage::READ);
  ASSERT_TRUE(storage.isOpened());
  cv::Mat matrix, distortion;
  storage["camera_matrix"] >> matrix;
  storage["distortion_coefficients"] >> distortion;
  EXPECT_EQ(static_cast<int>(storage["image_width"]), kOdd.width);
  EXPECT_EQ(static_cast<int>(storage["image_height"]), kOdd.height);
  EXPECT_EQ(static_cast<std::string>(storage["camera_name"]), "mono");
  ASSERT_EQ(matrix.type(), CV_64F);
  EXPECT_EQ(cv::norm(matrix, cv::Mat(kOdd.matrix()), cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(distortion, kOdd.distortion(), cv::NORM_INF), 0);
  EXPECT_EQ(read_camera_file(file).k3, kOdd.k3) << "and by our own";
}

TEST(CameraFile, WrittenForRosHasWhatItsReaderTakes) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "c.yaml";
  write_camera_file(file, kOdd, "mono");
  const YAML::Node root =
      YAML::LoadFile(file.string());  // ROS reads it with yaml-cpp, and refuses a file without one of these
  EXPECT_EQ(root["camera_name"].as<std::string>(), "mono");
  EXPECT_EQ(root["image_width"].as<int>(), kOdd.width);
  EXPECT_EQ(root["distortion_model"].as<std::string>(), "plumb_bob");
  const auto numbers = [&](const char* matrix, int rows, int cols) {
    EXPECT_EQ(root[matrix]["rows"].as<int>(), rows);
    EXPECT_EQ(root[matrix]["cols"].as<int>(), cols);
    return root[matrix]["data"].as<std::vector<double>>();
  };
  EXPECT_EQ(numbers("camera_matrix", 3, 3)[0], kOdd.fx);
  EXPECT_EQ(numbers("distortion_coefficients", 1, 5)[3], kOdd.p2);
  EXPECT_EQ(numbers("rectification_matrix", 3, 3)[8], 1);
  EXPECT_EQ(numbers("projection_matrix", 3, 4)[5], kOdd.fy);
  EXPECT_EQ(read_camera_file(file).cx, kOdd.cx) << "and by our own";
}

}  // namespace
}  // namespace tankrig
