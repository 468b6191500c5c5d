// From stripes to clouds: analytic planes, gates, order, files.
#include "reconstruction/stripe/stripe_reconstruction.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <fstream>
#include <random>
#include <sstream>

#include "core/input_error.hpp"
#include "core/settings_table.hpp"
#include "reconstruction/stripe/particle_filter.hpp"
#include "tests/stripe/generated_stripe.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

CameraModel distorted_camera() { return {240, 200, 210, 245, 118.3, 97.1, -0.21, 0.07, 0.001, -0.002, 0.01}; }

Plane plane_of(const Vector3d& normal, const Vector3d& point) {
  Plane plane;
  plane.normal = normal.normalized();
  plane.offset = -plane.normal.dot(point);
  return plane;
}

TEST(Triangulation, MeetsAnAnalyticPlaneThroughADistortedLens) {
  const CameraModel camera = distorted_camera();
  const Plane sheet = plane_of({0.1, 0.9, -0.3}, {0, 0.05, 0.8});
  for (const bool rows : {false, true}) {
    StripeDetection detection;
    detection.orientation = rows ? StripeOrientation::kRows : StripeOrientation::kColumns;
    std::vector<Vector3d> truth;
    for (double x = -0.3; x < 0.3; x += 0.01)
      for (const double z : {0.7, 0.9}) {
        Vector3d p{x, 0, z};
        p.y() = -(sheet.normal.x() * x + sheet.normal.z() * z + sheet.offset) / sheet.normal.y();
        const auto pixel = camera.project(p);
        ASSERT_TRUE(pixel);
        // The peak is stored in float: the truth is where that float's ray meets the sheet.
        const auto u = static_cast<float>(pixel->x()), v = static_cast<float>(pixel->y());
        const Vector3d ray = camera.ray(u, v);
        truth.push_back(ray * (-sheet.offset / sheet.normal.dot(ray)));
        EXPECT_LT((truth.back() - p).norm(), 1e-5);
        StripePeak peak;
        peak.column = rows ? v : u;
        peak.position = rows ? u : v;
        peak.sigma_px = 0.1f;
        detection.peaks.push_back(peak);
      }
    std::vector<CloudPoint> points;
    StripeStatistics statistics;
    triangulate(detection, camera, sheet, 7, {}, points, statistics);
    ASSERT_EQ(points.size(), truth.size());
    for (std::size_t i = 0; i < truth.size(); ++i) {
      EXPECT_LT((points[i].p - truth[i]).norm(), 1e-9);
      EXPECT_LT(std::abs(sheet.distance(points[i].p)), 1e-12);
      EXPECT_EQ(points[i].frame, 7);
      EXPECT_GT(points[i].sigma, 0);
    }
  }
}

TEST(Triangulation, MeetsAnAnalyticPlaneThroughAFlatPort) {
  CameraModel camera = distorted_camera();
  camera.port = FlatPort{0.05, 0.008, Vector3d(0.03, -0.02, 1).normalized()};
  const Plane sheet = plane_of({0.1, 0.9, -0.3}, {0, 0.05, 0.8});
  StripeDetection detection;
  std::vector<Vector3d> truth;
  for (double x = -0.2; x < 0.2; x += 0.01) {
    Vector3d p{x, 0, 0.9};
    p.y() = -(sheet.normal.x() * x + sheet.normal.z() * p.z() + sheet.offset) / sheet.normal.y();
    const auto pixel = camera.project(p);
    ASSERT_TRUE(pixel);
    detection.peaks.push_back({static_cast<float>(pixel->x()), static_cast<float>(pixel->y()), 0.1f, 1});
    truth.push_back(p);
  }
  std::vector<CloudPoint> points;
  StripeStatistics statistics;
  triangulate(detection, camera, sheet, 0, {}, points, statistics);
  ASSERT_EQ(points.size(), truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_LT((points[i].p - truth[i]).norm(), 1e-5) << "a peak is stored in float";
    EXPECT_LT(std::abs(sheet.distance(points[i].p)), 1e-12);
  }
}

TEST(Triangulation, PropagatesPixelAndPlaneUncertaintyAlongTheRay) {
  CameraModel camera{640, 480, 600, 600, 319.5, 239.5};
  const Plane sheet = plane_of({0, 1, -0.4}, {0, 0, 1});
  StripeDetection detection;
  detection.peaks.push_back({319.5f, 239.5f, 0.2f, 1});
  std::vector<CloudPoint> points;
  StripeStatistics statistics;
  TriangulationParameters p;
  triangulate(detection, camera, sheet, 0, p, points, statistics);
  // z = -offset / (n_y * y + n_z) and y = 1/600 per pixel: dz/dv = z * n_y / (600 * |n_z|).
  EXPECT_NEAR(points[0].sigma, 0.2 * 1.0 / (600 * 0.4), 2e-6);
  p.plane_angle_sigma = 1e-3;
  triangulate(detection, camera, sheet, 0, p, points, statistics);
  const double lever = std::sqrt(1 - std::pow(sheet.offset, 2)), sine = std::abs(sheet.normal.z());
  EXPECT_NEAR(points[1].sigma, std::hypot(0.2 / 240, 1e-3 * lever / sine), 2e-6);
}

TEST(Triangulation, RejectsPointsBehindTheCameraAndGrazingRays) {
  const CameraModel camera{640, 480, 600, 600, 319.5, 239.5};
  StripeDetection detection;
  detection.peaks.push_back({320, 240, 0.1f, 1});
  std::vector<CloudPoint> points;
  StripeStatistics statistics;
  triangulate(detection, camera, plane_of({0, 0.5, 1}, {0, 0, -1}), 0, {}, points, statistics);
  triangulate(detection, camera, plane_of({0, 1, 0.01}, {0, 0.1, 1}), 0, {}, points, statistics);
  EXPECT_TRUE(points.empty());
  EXPECT_EQ(statistics.behind_camera, 1u);
  EXPECT_EQ(statistics.grazing, 1u);
}

/// A sheet swept over a flat floor 1 m before the camera, which looks at it squarely.
struct Sweep {
  CameraModel camera{240, 200, 210, 245, 118.3, 97.1, -0.1, 0.02};
  Plane floor = plane_of({0, 0, 1}, {0, 0, 1});
  std::vector<StripeFrame> frames;

  explicit Sweep(int count) {
    for (int i = 0; i < count; ++i) {
      const Plane sheet = plane_of({0.05, 1, -0.5}, {0, -0.1 + 0.004 * i, 1});
      GeneratedStripe stripe;
      stripe.noise = 3;
      stripe.seed = static_cast<unsigned>(i + 1);
      stripe.row = [camera = camera, sheet](int x) { return row_of(camera, sheet, x); };
      frames.push_back({[stripe] { return stripe.image(); }, sheet, 10 + i, Transform::Identity()});
    }
  }

  static double row_of(const CameraModel& camera, const Plane& sheet, int column) {
    double row = 100;
    for (int k = 0; k < 50; ++k) {
      const Vector2d q = camera.normalized(column, row);
      const double y = -(sheet.offset + sheet.normal.x() * q.x() + sheet.normal.z()) / sheet.normal.y();
      row += (y - q.y()) * camera.fy;
    }
    return row;
  }
};

TEST(StripeReconstruction, FindsTheFloorInTheRightFrame) {
  Sweep sweep(12);
  const Transform aMc = make_transform_rpy({0.3, -0.2, 1.5}, {M_PI, 0, 0.4});
  for (StripeFrame& frame : sweep.frames) frame.aMc = aMc;
  StripeReconstructionParameters p;
  std::size_t last = 0;
  const StripeResult result =
      reconstruct_stripe(sweep.frames, sweep.camera, {}, p, "b", [&](std::size_t done, std::size_t total) {
        EXPECT_EQ(total, 12u);
        EXPECT_EQ(done, last + 1);
        last = done;
      });
  EXPECT_EQ(last, 12u);
  EXPECT_EQ(result.cloud.frame, "b");
  EXPECT_EQ(result.orientation, StripeOrientation::kColumns);
  EXPECT_GE(result.cloud.points.size(), 12u * 235u);
  const Plane floor_a = aMc * sweep.floor;
  double squares = 0;
  int previous = -1;
  for (const CloudPoint& point : result.cloud.points) {
    squares += std::pow(floor_a.distance(point.p), 2);
    EXPECT_GE(point.frame, previous);
    previous = point.frame;
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(result.cloud.points.size())), 5e-4);
  EXPECT_EQ(result.rows.size(), result.statistics.peaks);
  const StripeStatistics& s = result.statistics;
  EXPECT_EQ(s.peaks, s.points + s.behind_camera + s.grazing + s.outside_workspace + s.particle);
  EXPECT_EQ(s.points, result.cloud.points.size());
}

TEST(StripeReconstruction, GivesTheSameBitsWithOneThreadAndWithMany) {
  const Sweep sweep(6);
  const auto run = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return reconstruct_stripe(sweep.frames, sweep.camera, {}, {}, "c");
  };
  const StripeResult one = run(1), many = run(4);
  ASSERT_EQ(one.cloud.points.size(), many.cloud.points.size());
  for (std::size_t i = 0; i < one.cloud.points.size(); ++i) {
    EXPECT_EQ(one.cloud.points[i].p, many.cloud.points[i].p);
    EXPECT_EQ(one.cloud.points[i].sigma, many.cloud.points[i].sigma);
  }
}

TEST(StripeReconstruction, RunsThePapersDetectorToo) {
  const Sweep sweep(6);
  StripeReconstructionParameters p;
  p.detector = PaperStripeParameters::simulation();
  const StripeResult result = reconstruct_stripe(sweep.frames, sweep.camera, {}, p, "c");
  EXPECT_GE(result.cloud.points.size(), 6u * 235u);
  for (const CloudPoint& point : result.cloud.points) EXPECT_LT(std::abs(sweep.floor.distance(point.p)), 0.02);
}

TEST(StripeReconstruction, FindsTheOrientationForThePapersDetectorToo) {
  Sweep sweep(6);
  StripeReconstructionParameters upright;
  upright.detector = PaperStripeParameters::simulation();
  EXPECT_EQ(reconstruct_stripe(sweep.frames, sweep.camera, {}, upright, "c").orientation, StripeOrientation::kColumns);
  // The same tank on its side: x and y change places everywhere.
  CameraModel& c = sweep.camera;
  std::swap(c.width, c.height), std::swap(c.fx, c.fy), std::swap(c.cx, c.cy);
  for (StripeFrame& frame : sweep.frames) {
    std::swap(frame.cPl.normal.x(), frame.cPl.normal.y());
    frame.load = [load = frame.load]() -> cv::Mat { return load().t(); };
  }
  const StripeResult turned = reconstruct_stripe(sweep.frames, c, {}, upright, "c");
  EXPECT_EQ(turned.orientation, StripeOrientation::kRows);
  EXPECT_GE(turned.cloud.points.size(), 6u * 235u);
  for (const CloudPoint& point : turned.cloud.points) EXPECT_LT(std::abs(sweep.floor.distance(point.p)), 0.02);
  StripeReconstructionParameters told = upright;
  std::get<PaperStripeParameters>(told.detector).orientation = StripeOrientation::kColumns;
  EXPECT_EQ(reconstruct_stripe(sweep.frames, c, {}, told, "c").orientation, StripeOrientation::kColumns);
}

TEST(StripeReconstruction, CountsWhatLiesOutsideTheWorkspace) {
  const Sweep sweep(6);
  StripeReconstructionParameters p;
  p.workspace = WorkspaceBox{{-0.1, -1, 0.9}, {0.1, 1, 1.1}};
  const StripeResult result = reconstruct_stripe(sweep.frames, sweep.camera, {}, p, "c");
  EXPECT_GT(result.statistics.outside_workspace, 100u);
  EXPECT_GT(result.cloud.points.size(), 100u);
  for (const CloudPoint& point : result.cloud.points) EXPECT_LE(std::abs(point.p.x()), 0.1);
}

TEST(StripeReconstruction, RefusesAnImageOfAnotherSizeThanTheCamera) {
  Sweep sweep(2);
  sweep.frames[1].load = [] { return cv::Mat(10, 20, CV_8UC3); };
  EXPECT_THROW(reconstruct_stripe(sweep.frames, sweep.camera, {}, {}, "c"), InputError);
}

TEST(StripeReconstruction, OfNothingIsAnEmptyCloud) {
  const StripeResult result = reconstruct_stripe({}, distorted_camera(), {}, {}, "b");
  EXPECT_TRUE(result.cloud.points.empty());
  EXPECT_EQ(result.cloud.frame, "b");
}

TEST(ParticleFilter, KeepsSurfacesAndDropsWhatFloatsAlone) {
  std::vector<CloudPoint> points;
  const auto add = [&](double x, double y, double z, int frame) {
    CloudPoint point;
    point.p = {x, y, z};
    point.frame = frame;
    points.push_back(point);
  };
  for (int frame = 0; frame < 5; ++frame)
    for (int i = 0; i < 30; ++i) add(0.002 * i, 0.004 * frame, 1, frame);
  const std::size_t surface = points.size();
  for (int i = 0; i < 6; ++i) add(0.002 * i, 0.01, 0.7, 2);
  const std::size_t speck = points.size();
  for (int i = 0; i < 60; ++i) add(0.001 * i, 0.5, 1, 3);  // one line of a single frame, long enough
  const std::vector<bool> keep = confirmed_points(points, 0.015, 24);
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_EQ(keep[i], i < surface || i >= speck) << i;
}

TEST(ParticleFilter, KeepsWhatItsDefinitionKeeps) {
  constexpr double kRadius = 0.015;
  constexpr int kRun = 8;
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-0.15, 0.15), step(-0.012, 0.012);
    std::vector<CloudPoint> points;
    for (int frame = 0; frame < 40; ++frame)
      for (int piece = 0; piece < 3; ++piece) {
        CloudPoint point;
        point.frame = frame;
        point.p = Vector3d(place(random), place(random), place(random));
        if (piece == 0 && frame % 2 == 1) point.p = points.back().p;  // one cell, two frames in sequence
        for (int i = 0; i < 10; ++i, point.p += Vector3d(step(random), step(random), step(random)))
          points.push_back(point);
      }
    const std::vector<bool> keep = confirmed_points(points, kRadius, kRun);
    std::size_t by_others = 0, by_own = 0, dropped = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      bool other = false;
      int own = 0;
      for (std::size_t j = 0; j < points.size(); ++j) {
        const double distance = (points[j].p - points[i].p).norm();
        if (points[j].frame != points[i].frame)
          other = other || distance <= kRadius;
        else if (j != i)
          own += distance <= 2 * kRadius;
      }
      EXPECT_EQ(keep[i], other || own >= kRun) << i;
      ++(other ? by_others : own >= kRun ? by_own : dropped);
    }
    EXPECT_GT(by_others, 50u);
    EXPECT_GT(by_own, 50u);
    EXPECT_GT(dropped, 50u);
  }
}

TEST(StripeCsv, NamesWhatRunsAlongAndAcross) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "stripe.csv";
  const auto text = [&] {
    std::ostringstream out;
    out << std::ifstream(path).rdbuf();
    return out.str();
  };
  const std::vector<StripeRow> rows{{3, {12, 100.25f, 0.125f, 0.5f}}};
  write_stripe_csv(path, rows, StripeOrientation::kColumns);
  EXPECT_EQ(text(), "frame,column_px,row_px,sigma_px,intensity\n3,12,100.2500,0.1250,0.5000\n");
  write_stripe_csv(path, rows, StripeOrientation::kRows);
  EXPECT_EQ(text(), "frame,row_px,column_px,sigma_px,intensity\n3,12,100.2500,0.1250,0.5000\n");
  EXPECT_THROW(write_stripe_csv("/nowhere/at/all.csv", rows, StripeOrientation::kRows), InputError);
}

TEST(StripeConfig, ReadsBothSectionsAndRefusesWhatIsOutOfRange) {
  const TemporaryFolder folder;
  const ConfigNode node = ConfigNode::load(
      folder.write("stripe.yaml",
                   "laser:\n  orientation: rows\n  min_snr: 4\n  smoothing_px: 3\nlaser_paper:\n  preset: simulation\n"
                   "  hue_min: 40\n  orientation: auto\nbad:\n  hue_min: 60\n  hue_max: 50\n"));
  const StripeParameters ours = settings_from(node.child("laser"), kStripeKeys);
  EXPECT_EQ(ours.orientation, StripeOrientation::kRows);
  EXPECT_EQ(ours.min_snr, 4);
  EXPECT_EQ(ours.smoothing_px, 3);
  EXPECT_EQ(ours.min_run, StripeParameters{}.min_run);
  const PaperStripeParameters paper = settings_from(node.child("laser_paper"), kPaperStripeKeys);
  EXPECT_EQ(paper.hue_min, 40);
  EXPECT_EQ(paper.hue_max, 118);
  EXPECT_EQ(paper.orientation, StripeOrientation::kAuto);
  EXPECT_EQ(paper.value_min, 40);
  EXPECT_THROW(settings_from(node.child("bad"), kPaperStripeKeys), InputError);
  node.finish();
}

}  // namespace
}  // namespace tankrig
