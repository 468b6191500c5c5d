// Our camera files in the hands of the programs they are for: ROS's converter, mrcal, and the YAML reader of Kalibr.
#include <gtest/gtest.h>

#include <cstdlib>

#include "core/camera_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

const CameraModel kLeft{640, 480, 1600 / 3.0, 561.1, 331.0, 1e3 / 3, -0.28, 0.09, 0.001 / 3, -0.0007, 0};
CameraModel right() { return {640, 480, 541, 561, 318, 240, -0.26, 1e-10, 0, 1e-5, 0}; }

bool has_python(const std::string& module) {
  return std::system(("/usr/bin/python3 -c 'import " + module + "' 2>/dev/null").c_str()) == 0;
}

/// What a Python script prints.
std::string python(const TemporaryFolder& folder, const std::string& script) {
  folder.write("ask.py", script);
  EXPECT_EQ(std::system(("cd " + folder.path().string() + " && /usr/bin/python3 ask.py >answer 2>log").c_str()), 0)
      << folder.read("log");
  return folder.read("answer");
}

void expect_same(const CameraModel& a, const CameraModel& b) {
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  for (const auto member : {&CameraModel::fx, &CameraModel::fy, &CameraModel::cx, &CameraModel::cy, &CameraModel::k1,
                            &CameraModel::k2, &CameraModel::p1, &CameraModel::p2, &CameraModel::k3})
    EXPECT_DOUBLE_EQ(a.*member, b.*member);
}

TEST(CameraReaders, RosConvertsOurFile) {
  constexpr const char* kConvert = "/usr/lib/camera_calibration_parsers/convert";
  if (!std::filesystem::exists(kConvert)) GTEST_SKIP() << "Debian's camera-calibration-parsers-tools is not installed";
  const TemporaryFolder folder;
  write_camera_file(folder.path() / "ours.yaml", kLeft, "left");
  ASSERT_EQ(
      std::system(("cd " + folder.path().string() + " && " + kConvert + " ours.yaml theirs.yaml >log 2>&1").c_str()), 0)
      << folder.read("log");
  expect_same(read_camera_file(folder.path() / "theirs.yaml"), kLeft);
}

TEST(CameraReaders, MrcalReadsAndWritesOurModel) {
  if (!has_python("mrcal")) GTEST_SKIP() << "Debian's python3-mrcal is not installed";
  const TemporaryFolder folder;
  CameraModel model = kLeft;
  model.k3 = 0.15;
  const Transform cMr = make_transform_rpy({-0.1, 0.02, 0.003}, {0.01, -0.03, 0.005});
  write_camera_file(folder.path() / "ours.cameramodel", CameraFileFormat::kMrcal, {{"left", model, cMr, {}}});
  const Vector3d p(0.2, -0.15, 1);
  std::istringstream answer(python(folder, R"(
import mrcal, numpy as np
m = mrcal.cameramodel('ours.cameramodel')
q = mrcal.project(mrcal.transform_point_rt(m.extrinsics_rt_fromref(), np.array((0.2, -0.15, 1.))), *m.intrinsics())
print('%.17g %.17g' % tuple(q))
m.write('theirs.cameramodel')
)"));
  double u = 0, v = 0;
  answer >> u >> v;
  EXPECT_LT((model.project(cMr * p).value() - Vector2d(u, v)).norm(), 1e-9);
  const FileCamera back = read_camera_file_whole(folder.path() / "theirs.cameramodel").front();
  EXPECT_NEAR(back.model.fx, model.fx, 1e-6) << "mrcal writes ten digits";
  EXPECT_NEAR(back.model.k3, model.k3, 1e-9);
  EXPECT_TRUE(back.cMr->isApprox(cMr, 1e-8));
}

TEST(CameraReaders, KalibrsYamlReaderFindsNumbers) {
  if (!has_python("yaml")) GTEST_SKIP() << "Debian's python3-yaml is not installed";
  const TemporaryFolder folder;
  const Transform rMc = make_transform_rpy({-0.1, 1e-9, 0.003}, {0.01, -0.03, 0.005});
  write_camera_file(folder.path() / "camchain.yaml", CameraFileFormat::kKalibr,
                    {{"left", kLeft, Transform::Identity(), {}}, {"right", right(), rMc, {}}});
  std::istringstream answer(python(folder, R"(
import yaml
c = yaml.safe_load(open('camchain.yaml'))['cam1']
numbers = c['intrinsics'] + c['distortion_coeffs'] + sum(c['T_cn_cnm1'], []) + c['resolution']
assert all(type(n) in (int, float) for n in numbers), numbers
print(*[repr(n) for n in numbers])
)"));
  std::vector<double> expected{541, 561, 318, 240, -0.26, 1e-10, 0, 1e-5};
  for (int i = 0; i < 16; ++i) expected.push_back(rMc.matrix()(i / 4, i % 4));
  expected.insert(expected.end(), {640, 480});
  for (const double value : expected) {
    double theirs = 0;
    ASSERT_TRUE(answer >> theirs);
    EXPECT_DOUBLE_EQ(theirs, value);
  }
}

}  // namespace
}  // namespace tankrig
