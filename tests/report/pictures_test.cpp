// Pictures have the right colours in the right places.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bench/report/cloud_picture.hpp"
#include "bench/report/coverage_picture.hpp"
#include "bench/report/stripe_picture.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

const Colour kGreen{0, 255, 0};

/// 140 x 300 x 160 mm, origin at the centre of the top face.
TriangleMesh box() {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.push_back({i & 1 ? 0.07 : -0.07, i & 2 ? 0.15 : -0.15, i & 4 ? 0.0 : -0.16});
  const int quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& q : quads) {
    mesh.triangles.push_back({q[0], q[1], q[2]});
    mesh.triangles.push_back({q[0], q[2], q[3]});
  }
  return mesh;
}

Viewpoint from_above() { return {{0, 0, 1}, {0, 1, 0}}; }

/// Is `colour` (within `tolerance` of each channel) anywhere in the part of the picture?
int count_of(const cv::Mat& picture, const Colour& colour, int tolerance, cv::Rect part = {}) {
  if (part.area() == 0) part = cv::Rect({}, picture.size());
  int count = 0;
  for (int y = part.y; y < part.br().y; ++y)
    for (int x = part.x; x < part.br().x; ++x) {
      const Colour& c = picture.at<Colour>(y, x);
      count += std::abs(c[0] - colour[0]) <= tolerance && std::abs(c[1] - colour[1]) <= tolerance &&
               std::abs(c[2] - colour[2]) <= tolerance;
    }
  return count;
}

TEST(Canvas, HidesWhatLiesBehind) {
  const std::vector<Vector3d> corners{{-1, -1, 0}, {1, 1, 0}};
  Canvas canvas(100, 100, from_above(), corners);
  const Colour red{0, 0, 255}, blue{255, 0, 0};
  canvas.dot({0, 0, -0.5}, red, 4, 0);
  canvas.triangle({-1, -1, 0}, {1, -1, 0}, {0, 1, 0}, {200, 200, 200});
  canvas.dot({0, -0.5, 0.5}, blue, 4, 0);
  canvas.dot({0, -0.5, 0.2}, red, 4, 0);
  const cv::Mat picture = canvas.picture();
  EXPECT_EQ(count_of(picture, red, 60), 0);
  EXPECT_GT(count_of(picture, blue, 10), 30);
  EXPECT_NEAR(canvas.pixels_per_metre(), 45, 1e-9);
  EXPECT_EQ(picture.at<Colour>(72, 50), blue) << "half a metre below the middle";
  EXPECT_EQ(picture.at<Colour>(2, 2), kWhite);
}

TEST(CloudPicture, ColoursEachPointByItsVerdictWhereItLies) {
  PointCloud cloud;
  std::vector<PointVerdict> verdicts;
  const auto put = [&](double x, double y, double z, PointVerdict verdict) {
    for (int i = 0; i < 40; ++i)
      for (int j = 0; j < 20; ++j) {
        CloudPoint point;
        point.p = {x + 0.0004 * i, y + 0.0004 * j, z};
        cloud.points.push_back(point);
        verdicts.push_back(verdict);
      }
  };
  put(-0.01, 0.10, 0, PointVerdict::kObject);
  put(-0.01, -0.10, 0.03, PointVerdict::kOutlier);
  put(0.10, 0, -0.16, PointVerdict::kGround);
  CloudPictureOptions options;
  options.view = from_above();
  const cv::Mat picture = draw_cloud_over_object(cloud, verdicts, box(), options);
  ASSERT_EQ(picture.size(), cv::Size(options.width, options.height));
  const cv::Rect upper(300, 0, 300, 320), lower(300, 320, 300, 320), right(565, 290, 60, 60), middle(420, 300, 60, 40);
  // Object greens, outlier blues, ground black; the legend is in the corner, outside of these parts.
  const auto green = [&](cv::Rect part) { return count_of(picture, {0, 160, 0}, 95, part); };
  const auto blue = [&](cv::Rect part) { return count_of(picture, {255, 0, 0}, 95, part); };
  EXPECT_GT(green(upper), 100);
  EXPECT_EQ(green(lower), 0);
  EXPECT_GT(blue(lower), 100);
  EXPECT_EQ(blue(upper), 0);
  EXPECT_GT(count_of(picture, {0, 0, 0}, 30, right), 100);
  EXPECT_GT(count_of(picture, {225, 223, 221}, 25, middle), 2000) << "the object in light grey";
  verdicts.pop_back();
  EXPECT_THROW(draw_cloud_over_object(cloud, verdicts, box(), options), InputError);
}

TEST(CloudPicture, DrawsAnEmptyCloud) {
  EXPECT_EQ(draw_cloud_over_object({}, {}, box(), {}).size(), cv::Size(900, 640));
}

TEST(StripePicture, MarksTheStripeAndMagnifiesItsMiddle) {
  cv::Mat image(480, 640, CV_8UC3, cv::Scalar(90, 90, 90));
  std::vector<Vector2d> stripe;
  for (int x = 0; x < 640; ++x) stripe.push_back({double(x), 300.5});
  const cv::Mat picture = draw_stripe_frame(image, stripe);
  EXPECT_EQ(picture.size(), image.size());
  const Colour mark{60, 40, 255};
  EXPECT_GT(count_of(picture, mark, 60, {0, 299, 640, 4}), 500);
  EXPECT_EQ(count_of(picture, mark, 60, {0, 320, 300, 160}), 0) << "no marks off the stripe";
  // The inset is in a corner away from the stripe: the upper half.
  EXPECT_GT(count_of(picture, mark, 60, {0, 0, 640, 200}), 100);
  EXPECT_EQ(draw_stripe_frame(cv::Mat(480, 640, CV_8U, cv::Scalar(0)), {}).type(), CV_8UC3)
      << "grey, and nothing found";
}

TEST(CoverageMap, ShowsCoveredMissedAndUnseeableSidesOfTheBox) {
  const TriangleMesh mesh = box();
  const auto samples = sample_surface(mesh, 20000);
  std::vector<std::uint8_t> covered(samples.size()), reachable(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Vector3d& p = samples[i].p;
    reachable[i] = p.z() > -1e-6 || p.x() > 0.07 - 1e-6;  // top and +x
    covered[i] = p.z() > -1e-6;
  }
  const cv::Mat map = draw_coverage_map(mesh, samples, covered, reachable, "coverage");
  // The cross is 600 mm wide on 846 px: -x, top, +x and bottom stand in a row.
  const double s = (900 - 36 - 18) / 0.6;
  const int y = int(34 + 0.16 * s + 6 + 0.15 * s);
  const auto at = [&](double metres, int gaps) { return map.at<Colour>(y, int(18 + metres * s) + 6 * gaps); };
  const Colour unseeable{210, 208, 206}, green{80, 160, 40}, orange{40, 140, 245};
  EXPECT_EQ(at(0.08, 0), unseeable);
  EXPECT_EQ(at(0.16 + 0.07, 1), green);
  EXPECT_EQ(at(0.30 + 0.08, 2), orange);
  EXPECT_EQ(at(0.46 + 0.07, 3), unseeable);
  EXPECT_THROW(draw_coverage_map(mesh, samples, {}, reachable), InputError);
}

TEST(CoverageMap, LaysNeighbouringSidesEdgeToEdge) {
  // Covered: the strip along the edge that the top and the +x side share. It must show on both sides of that edge.
  const TriangleMesh mesh = box();
  const auto samples = sample_surface(mesh, 20000);
  std::vector<std::uint8_t> covered(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    covered[i] = (samples[i].p - Vector3d(0.07, samples[i].p.y(), 0)).norm() < 0.02;
  const cv::Mat map = draw_coverage_map(mesh, samples, covered, {});
  const double s = (900 - 36 - 18) / 0.6;
  const int y = int(34 + 0.16 * s + 6 + 0.15 * s), edge = int(18 + 0.30 * s) + 6;
  const Colour green{80, 160, 40}, orange{40, 140, 245};
  EXPECT_EQ(map.at<Colour>(y, edge - 10), green);
  EXPECT_EQ(map.at<Colour>(y, edge + 6 + 10), green);
  EXPECT_EQ(map.at<Colour>(y, edge - 60), orange);
  EXPECT_EQ(map.at<Colour>(y, edge + 6 + 60), orange);
}

TEST(CoveredSamples, AreThoseNearAPointOfTheObjectOnly) {
  const std::vector<SurfaceSample> samples{
      {{0, 0, 0}, 0, 0.5f}, {{0.0199, 0, 0}, 0, 0.25f}, {{-0.005, 0, 0}, 0, 0.25f}};
  PointCloud cloud;
  cloud.points.resize(2);
  cloud.points[0].p = {0.01, 0, 0};
  cloud.points[1].p = {-0.005, 0, 0};
  EXPECT_THAT(covered_samples(samples, cloud, {PointVerdict::kObject, PointVerdict::kOutlier}, 0.010),
              testing::ElementsAre(1, 1, 0));
  EXPECT_THAT(covered_samples(samples, cloud, {PointVerdict::kObject, PointVerdict::kObject}, 0.010),
              testing::ElementsAre(1, 1, 1));
  EXPECT_THAT(covered_samples(samples, cloud, {PointVerdict::kObject, PointVerdict::kOutlier}, 0.0095),
              testing::ElementsAre(0, 0, 0));
}

}  // namespace
}  // namespace tankrig
