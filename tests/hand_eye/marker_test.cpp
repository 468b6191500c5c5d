#include "calibration/marker/marker.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <opencv2/aruco.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "core/input_error.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using testing::HasSubstr;

const CameraModel kCamera{640, 480, 600, 620, 322, 237, -0.1, 0.02, 0.001, -0.001, 0};

/// Albedo of a plate at (x, y) of g [m].
using Plate = std::function<double(double x, double y)>;

/// What the camera sees of the plate: 4 x 4 rays in a pixel.
cv::Mat picture_of(const Plate& plate, const Transform& cMg) {
  constexpr int kRays = 4;
  cv::Mat grey(kCamera.height, kCamera.width, CV_8U);
  const Transform gMc = cMg.inverse();
  for (int v = 0; v < kCamera.height; ++v)
    for (int u = 0; u < kCamera.width; ++u) {
      double sum = 0;
      for (int i = 0; i < kRays * kRays; ++i) {
        const Vector2d ray =
            kCamera.normalized(u - 0.5 + (i % kRays + 0.5) / kRays, v - 0.5 + (i / kRays + 0.5) / kRays);
        const Vector3d from = gMc.translation(), along = gMc.linear() * ray.homogeneous();
        const Vector3d p = from - along * (from.z() / along.z());
        sum += plate(p.x(), p.y());
      }
      grey.at<uchar>(v, u) = static_cast<uchar>(std::lround(20 + 200 * sum / (kRays * kRays)));
    }
  return grey;
}

Plate markers_plate(const GripperMarker& m, int dictionary) {
  std::vector<cv::Mat> drawn;
  const auto words = cv::aruco::getPredefinedDictionary(dictionary);
  const int modules = words->markerSize + 2;
  for (int k = 0; k < m.columns * m.rows; ++k) {
    cv::Mat one;
    words->drawMarker(m.first_id + k, modules, one, 1);
    drawn.push_back(one.clone());
  }
  return [m, drawn, modules](double x, double y) {
    const int column = static_cast<int>(std::floor(x / m.pitch)), row = static_cast<int>(std::floor(y / m.pitch));
    if (column < -1 || row < -1 || column > m.columns || row > m.rows) return 0.3;
    if (column < 0 || row < 0 || column >= m.columns || row >= m.rows) return 1.0;
    const double gap = (m.pitch - m.marker) / 2;
    const double u = (x - column * m.pitch - gap) / m.marker * modules,
                 v = (y - row * m.pitch - gap) / m.marker * modules;
    if (u < 0 || v < 0 || u >= modules || v >= modules) return 1.0;
    return drawn[static_cast<std::size_t>(row * m.columns + column)].at<uchar>(static_cast<int>(v), static_cast<int>(u))
               ? 1.0
               : 0.0;
  };
}

Plate dots_plate(const GripperMarker& m, double radius) {
  return [points = points_of(m), radius](double x, double y) {
    for (const Vector3d& p : points)
      if (std::hypot(x - p.x(), y - p.y()) < radius) return 0.0;
    return 1.0;
  };
}

const Transform kBefore = make_transform_rpy({-0.05, -0.05, 0.45}, {0.35, -0.3, 0.4});

double worst_error(const SeenMarker& seen, const Transform& cMg) {
  double worst = 0;
  for (std::size_t k = 0; k < seen.points.size(); ++k)
    worst = std::max(worst, (*kCamera.project(cMg * seen.points[k]) - seen.corners[k]).norm());
  return worst;
}

struct Words {
  const char* name;
  int opencv;
};
class Dictionaries : public testing::TestWithParam<Words> {};

TEST_P(Dictionaries, AreFoundCornerByCornerWithinATwentiethOfAPixel) {
  GripperMarker m;
  m.columns = 2;
  m.rows = 2;
  m.pitch = 0.07;
  m.marker = 0.055;
  m.dictionary = GetParam().name;
  m.first_id = 3;
  const SeenMarker seen = MarkerFinder(m).find(picture_of(markers_plate(m, GetParam().opencv), kBefore));
  ASSERT_EQ(seen.points.size(), 16u);
  std::printf("%s: worst corner %.3f px\n", GetParam().name, worst_error(seen, kBefore));
  EXPECT_LT(worst_error(seen, kBefore), 0.05);
  const auto pose = planar_pose(kCamera, seen);
  ASSERT_TRUE(pose);
  EXPECT_LT((pose->cMg.translation() - kBefore.translation()).norm(), 2e-3);
  EXPECT_FALSE(pose->flipped);
}

INSTANTIATE_TEST_SUITE_P(Marker, Dictionaries,
                         testing::Values(Words{"apriltag_36h11", cv::aruco::DICT_APRILTAG_36h11},
                                         Words{"4x4_50", cv::aruco::DICT_4X4_50}),
                         [](const auto& tested) { return std::string(tested.param.name); });

const std::vector<double> kDots{0, 0, 0.03, 0, 0.09, 0, 0, 0.06, 0.06, 0.05, 0.09, 0.09, 0.02, 0.09};

TEST(Marker, FindsDotsInTheirOrderWithinAFifthOfAPixel) {
  GripperMarker m;
  m.pattern = MarkerPattern::kDots;
  m.dots = kDots;
  const SeenMarker seen = MarkerFinder(m).find(picture_of(dots_plate(m, 0.006), kBefore));
  ASSERT_EQ(seen.points.size(), 7u);
  ASSERT_EQ(seen.corners.size(), 7u);
  std::printf("dots: worst %.3f px\n", worst_error(seen, kBefore));
  EXPECT_LT(worst_error(seen, kBefore), 0.2);
}

TEST(Marker, DoesNotTakeAMirroredPictureForTheMarker) {
  GripperMarker dots, tags;
  dots.pattern = MarkerPattern::kDots;
  dots.dots = kDots;
  cv::Mat mirrored;
  cv::flip(picture_of(dots_plate(dots, 0.006), kBefore), mirrored, 1);
  EXPECT_TRUE(MarkerFinder(dots).find(mirrored).corners.empty());
  cv::flip(picture_of(markers_plate(tags, cv::aruco::DICT_APRILTAG_36h11), kBefore), mirrored, 1);
  EXPECT_TRUE(MarkerFinder(tags).find(mirrored).corners.empty());
}

TEST(Marker, FindsNothingInADarkPicture) {
  EXPECT_TRUE(MarkerFinder(GripperMarker{}).find(cv::Mat::zeros(480, 640, CV_8U)).points.empty());
}

TEST(Marker, RefusesDotsThatLookTheSameAfterATurn) {
  GripperMarker m;
  m.pattern = MarkerPattern::kDots;
  m.dots = {0, 0, 0.1, 0, 0.1, 0.1, 0, 0.1, 0.05, 0.05};
  EXPECT_THAT(message_of<InputError>([&] { MarkerFinder{m}; }), HasSubstr("taken for each other"));
  m.dots = {0, 0, 0.1, 0, 0.2, 0, 0.3, 0, 0.4, 0};
  EXPECT_THAT(message_of<InputError>([&] { MarkerFinder{m}; }), HasSubstr("in a line"));
}

TEST(Marker, RefusesADictionaryNobodyKnows) {
  GripperMarker m;
  m.dictionary = "7x7";
  EXPECT_THAT(message_of<InputError>([&] { MarkerFinder{m}; }), HasSubstr("apriltag_36h11"));
}

TEST(Marker, KeepsBothPosesOfASmallFlatMarkerAndOneOfThemIsRight) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0, 0.2);
  GripperMarker m;
  int kept = 0, right = 0;
  for (int k = 0; k < 50; ++k) {
    const Transform cMg = make_transform_rpy({0.02, 0.01, 1.0}, {0.2, 0.02 * k - 0.5, 0.3});
    SeenMarker seen{points_of(m), {}};
    for (const Vector3d& p : seen.points)
      seen.corners.push_back(*kCamera.project(cMg * p) + Vector2d(noise(random), noise(random)));
    const auto pose = planar_pose(kCamera, seen);
    ASSERT_TRUE(pose);
    const auto near = [&](const Transform& found) {
      return Eigen::AngleAxisd(Eigen::Matrix3d(found.linear().transpose() * cMg.linear())).angle() < 0.15;
    };
    kept += pose->flipped.has_value();
    right += near(pose->cMg) || (pose->flipped && near(*pose->flipped));
  }
  EXPECT_GT(kept, 25);
  EXPECT_GE(right, 48);
}

}  // namespace
}  // namespace tankrig
