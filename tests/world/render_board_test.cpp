// Boards are where the scene says, and a foreign detector finds on them what is printed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <ctime>
#include <opencv2/aruco.hpp>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/imgproc.hpp>

#include "core/input_error.hpp"
#include "tests/world/render_scene.hpp"

namespace tankrig::sim::testing {
namespace {

using ::testing::HasSubstr;

BoardSpec checkerboard(const Transform& wMt) {
  BoardSpec board;
  board.name = "board";
  board.pattern = {BoardKind::kCheckerboard, 9, 7, 0.03, 0.02, 0.02, "4x4_50", 0};
  board.pose = wMt;
  return board;
}

/// Half a metre before the camera called `name`, a little turned, near the image's middle.
Transform before_camera(const Scene& scene, const std::string& name) {
  for (const CameraSpec& camera : scene.cameras)
    if (camera.name == name) return camera.wMc * make_transform_rpy({-0.10, -0.09, 0.55}, {0.25, -0.3, 0.1});
  return Transform::Identity();
}

TankWorld world_with(Scene scene, const BoardSpec& board) {
  scene.boards = {board};
  WorldOptions options;
  options.boards = {board.name};
  return TankWorld::from_scene(std::move(scene), options);
}

const CameraSpec& camera_of(const TankWorld& world, const std::string& name) {
  for (const CameraSpec& camera : world.cameras())
    if (camera.name == name) return camera;
  throw InputError("no camera " + name);
}

Vector2d seen(const CameraSpec& camera, const Transform& wMt, double x, double y) {
  return *camera.model.project(camera.wMc.inverse() * wMt * Vector3d(x, y, 0));
}

/// Worst distance between the corners of squares as refined by OpenCV and as projected [px].
double worst_corner(const cv::Mat& image, const CameraSpec& camera, const BoardSpec& board, const Transform& wMt) {
  std::vector<cv::Point2f> corners;
  std::vector<Vector2d> truth;
  for (int j = 1; j < board.pattern.rows; ++j)
    for (int i = 1; i < board.pattern.columns; ++i) {
      truth.push_back(seen(camera, wMt, i * board.pattern.pitch, j * board.pattern.pitch));
      corners.emplace_back(static_cast<float>(truth.back().x() + 0.7), static_cast<float>(truth.back().y() - 0.6));
    }
  cv::Mat grey;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  cv::cornerSubPix(grey, corners, {4, 4}, {-1, -1}, {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 50, 1e-4});
  double worst = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    worst = std::max(worst, (Vector2d(corners[i].x, corners[i].y) - truth[i]).norm());
  return worst;
}

TEST(RenderBoard, CornersOfABoardThatLiesThereAreWhereItStands) {
  const Scene scene = full_scene();
  const BoardSpec board = checkerboard(before_camera(scene, "mono"));
  const TankWorld world = world_with(scene, board);
  EXPECT_LT(worst_corner(world.render("mono", still(scene, 0)), camera_of(world, "mono"), board, board.pose), 0.12);
}

/// Traced face by face in the renderer; projected by the model that calibrates.
TEST(RenderBoard, CornersOfABoardBehindAFlatPortAreWhereTheModelSeesThem) {
  Scene scene = full_scene();
  CameraModel& model = scene.cameras[0].model;
  model.port = FlatPort{0.05, 0.010, Vector3d(0.03, -0.02, 1).normalized()};
  const BoardSpec lying = checkerboard(before_camera(scene, "mono"));
  const TankWorld world = world_with(scene, lying);
  EXPECT_LT(worst_corner(world.render("mono", still(scene, 0)), camera_of(world, "mono"), lying, lying.pose), 0.12);

  BoardSpec carried = lying;
  carried.place = BoardSpec::Place::kEndEffector;
  carried.pose = scene.arm.model.bMe(scene.arm.q).inverse() * scene.arm.wMb.inverse() * lying.pose;
  const TankWorld moving = world_with(scene, carried);
  EXPECT_LT(worst_corner(moving.render("mono", still(scene, 0)), camera_of(moving, "mono"), carried, lying.pose), 0.12);
}

TEST(RenderBoard, CornersOfABoardThatMovesAreWhereItStands) {
  Scene scene = full_scene();
  BoardSpec board = checkerboard(Transform::Identity());
  board.place = BoardSpec::Place::kEndEffector;
  board.pose = scene.arm.model.bMe(scene.arm.q).inverse() * scene.arm.wMb.inverse() * before_camera(scene, "left");
  const TankWorld world = world_with(scene, board);
  const Transform wMt = world.wMt("board", {}, scene.arm.q);
  EXPECT_TRUE(wMt.isApprox(before_camera(scene, "left"), 1e-9));
  EXPECT_LT(worst_corner(world.render("left", still(scene, 0)), camera_of(world, "left"), board, wMt), 0.12);

  Exposure later = still(scene, 0);
  for (JointVector& q : later.q) q[kElbow] += 0.03;
  const Transform moved = world.wMt("board", {}, later.q[1]);
  EXPECT_GT((moved.translation() - wMt.translation()).norm(), 0.005);
  EXPECT_LT(worst_corner(world.render("left", later), camera_of(world, "left"), board, moved), 0.12);
}

TEST(RenderBoard, LooksTheSameWhateverTheCameraSawBefore) {
  Scene scene = full_scene();
  BoardSpec board = checkerboard(Transform::Identity());
  board.place = BoardSpec::Place::kEndEffector;
  board.pose = scene.arm.model.bMe(scene.arm.q).inverse() * scene.arm.wMb.inverse() * before_camera(scene, "left");
  Exposure later = still(scene, 1);
  for (JointVector& q : later.q) q[kElbow] += 0.03;
  const TankWorld world = world_with(scene, board), fresh = world_with(scene, board);
  const cv::Mat first = world.render("left", still(scene, 0)), moved = world.render("left", later);
  const auto same = [](const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF) == 0; };
  EXPECT_FALSE(same(first, moved));
  EXPECT_TRUE(same(world.render("left", still(scene, 0)), first)) << "after another place";
  EXPECT_TRUE(same(world.render("left", still(scene, 0)), first)) << "after the same place";
  EXPECT_TRUE(same(fresh.render("left", later), moved)) << "as the first frame";
}

TEST(RenderBoard, OpenCvReadsACharucoBoardInEveryPlaceItIsShown) {
  Scene scene = full_scene();
  BoardSpec board;
  board.name = "charuco";
  board.pattern = {BoardKind::kCharuco, 9, 7, 0.04, 0.03, 0.02, "4x4_50", 0};
  board.place = BoardSpec::Place::kShown;
  board.shows = {{"mono", 4, 0.55, 0.9, 0.6, 1}, {"left", 2, 0.55, 0.9, 0.6, 1}};
  const TankWorld world = world_with(scene, board);
  const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50);
  const auto printed = cv::aruco::CharucoBoard::create(9, 7, 0.04f, 0.03f, dictionary);
  int found = 0;
  for (int place = 0; place < 6; ++place) {
    Exposure exposure = still(scene, 0);
    exposure.mid = {board.hold.count() * place};
    const CameraSpec& camera = camera_of(world, place < 4 ? "mono" : "left");
    const Transform wMt = world.wMt("charuco", exposure.mid, scene.arm.q);
    const cv::Mat image = world.render(camera.name, exposure);
    std::vector<std::vector<cv::Point2f>> markers;
    std::vector<int> ids, corner_ids;
    std::vector<cv::Point2f> corners;
    cv::aruco::detectMarkers(image, dictionary, markers, ids);
    ASSERT_GE(ids.size(), 4U) << "place " << place;
    cv::aruco::interpolateCornersCharuco(markers, ids, image, printed, corners, corner_ids);
    cv::Mat grey;
    cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
    cv::cornerSubPix(grey, corners, {3, 3}, {-1, -1}, {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 50, 1e-4});
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const cv::Point3f at = printed->chessboardCorners[corner_ids[i]];
      const Vector2d truth = seen(camera, wMt, at.x, at.y);
      EXPECT_LT((Vector2d(corners[i].x, corners[i].y) - truth).norm(), 0.35) << "place " << place << " corner " << i;
    }
    found += static_cast<int>(corners.size());
  }
  EXPECT_GT(found, 6 * 24);
}

TEST(RenderBoard, AForeseenPlaceCostsNoMoreThanOneThatWasSeenAndLooksTheSame) {
  Scene scene = full_scene();
  BoardSpec board = checkerboard(Transform::Identity());
  board.place = BoardSpec::Place::kShown;
  board.shows = {{"mono", 4, 0.5, 0.6, 0.5, 1}};
  board.hold = std::chrono::seconds{2};
  const TankWorld world = world_with(scene, board), unprepared = world_with(scene, board);
  EXPECT_EQ(world.next_place({1'900'000'000}), Stamp{2'000'000'000});
  EXPECT_EQ(world.next_place({2'000'000'000}), Stamp{4'000'000'000});
  EXPECT_FALSE(world_with(scene, checkerboard(before_camera(scene, "mono"))).next_place({0}));

  const auto cost = [&](const TankWorld& tank, const Exposure& exposure, cv::Mat& image) {
    const std::clock_t began = std::clock();
    image = tank.render("mono", exposure);
    return std::clock() - began;
  };
  Exposure exposure = still(scene, 0);
  cv::Mat foreseen, surprised;
  for (const TankWorld* tank : {&world, &unprepared}) tank->render("mono", exposure);
  std::clock_t cheap = 0, dear = 0;
  for (int place = 1; place < 4; ++place) {
    exposure.mid = {board.hold.count() * place};
    world.foresee_boards("mono", exposure);
    cheap += cost(world, exposure, foreseen);
    dear += cost(unprepared, exposure, surprised);
    EXPECT_EQ(cv::norm(foreseen, surprised, cv::NORM_INF), 0) << "place " << place;
  }
  std::printf("processor time of a place foreseen: %.0f %% of a new one's\n", 100.0 * cheap / dear);
  EXPECT_LT(2 * cheap, dear);
}

TEST(RenderBoard, OpenCvReadsAPlateOfMarkers) {
  const Scene scene = full_scene();
  BoardSpec board;
  board.name = "plate";
  board.pattern = {BoardKind::kMarkers, 2, 2, 0.07, 0.055, 0.005, "apriltag_36h11", 7};
  board.pose = before_camera(scene, "mono");
  const TankWorld world = world_with(scene, board);
  std::vector<std::vector<cv::Point2f>> markers;
  std::vector<int> ids;
  const auto parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
  cv::aruco::detectMarkers(world.render("mono", still(scene, 0)),
                           cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11), markers, ids,
                           parameters);
  ASSERT_THAT(ids, ::testing::UnorderedElementsAre(7, 8, 9, 10));
  for (std::size_t i = 0; i < ids.size(); ++i)
    for (int k = 0; k < 4; ++k) {
      const double x = (ids[i] - 7) % 2 * 0.07 + 0.0075 + (k == 1 || k == 2 ? 0.055 : 0),
                   y = (ids[i] - 7) / 2 * 0.07 + 0.0075 + (k >= 2 ? 0.055 : 0);
      const Vector2d truth = seen(camera_of(world, "mono"), board.pose, x, y);
      EXPECT_LT((Vector2d(markers[i][k].x, markers[i][k].y) - truth).norm(), 1.0) << "marker " << ids[i] << " " << k;
    }
}

TEST(RenderBoard, TheStripeFallsOnABoardThatLiesThere) {
  Scene scene = empty_scene();
  const Transform wMe = scene.arm.wMb * scene.arm.model.bMe(scene.arm.q);
  scene.laser.eMl = wMe.inverse() * make_transform_rpy({0.02, 0, 0.9}, {M_PI, 0, 0});  // the sheet x = 0.02, downwards
  BoardSpec board = checkerboard(make_transform_rpy({-0.15, 0.12, 0.3}, {M_PI, 0, 0}));
  const TankWorld world = world_with(scene, board);
  const cv::Mat dark = world.render("mono", still(scene, 0)), lit = world.render("mono", still(scene, 1));
  const CameraSpec& camera = camera_of(world, "mono");
  int bright = 0;
  for (double y = -0.06; y < 0.09; y += 0.01) {
    const auto pixel = camera.model.project(camera.wMc.inverse() * Vector3d(0.02, y, 0.3));
    const cv::Point at(static_cast<int>(std::lround(pixel->x())), static_cast<int>(std::lround(pixel->y())));
    if (lit.at<uchar>(at) > dark.at<uchar>(at) + 10) ++bright;
  }
  EXPECT_GE(bright, 7);  // of 15: the white squares
}

TEST(RenderBoard, ABoardInFrontHidesTheArm) {
  Scene scene = full_scene();
  scene.arm.q[kElbow] = 0.4;
  BoardSpec board = checkerboard(before_camera(scene, "mono"));
  board.place = BoardSpec::Place::kShown;
  board.shows = {{"mono", 1, 0.2, 0.2, 0, 1}};  // fills the image
  const TankWorld world = world_with(scene, board);
  const CameraSpec& camera = camera_of(world, "mono");
  const Transform cMt = camera.wMc.inverse() * world.wMt("board", {}, scene.arm.q);
  const auto pixel = camera.model.project(cMt * Vector3d(0.015, 0.045, 0));  // the middle of a white square
  const auto next = camera.model.project(cMt * Vector3d(0.045, 0.045, 0));   // of a black one
  ASSERT_TRUE(pixel && next && camera.model.contains(*pixel) && camera.model.contains(*next));
  const cv::Mat with = world.render("mono", still(scene, 0));
  const auto green = [&](const Vector2d& p) {
    return with.at<cv::Vec3b>(static_cast<int>(std::lround(p.y())), static_cast<int>(std::lround(p.x())))[1];
  };
  EXPECT_GT(green(*pixel), 2 * green(*next));
}

TEST(RenderBoard, OnlyBoardsThatWereAskedForAreThere) {
  Scene scene = small_scene();
  const cv::Mat bare = TankWorld::from_scene(scene, {}).render("mono", still(scene, 0));
  scene.boards = {checkerboard(before_camera(scene, "mono"))};
  EXPECT_EQ(cv::norm(bare, TankWorld::from_scene(scene, {}).render("mono", still(scene, 0)), cv::NORM_INF), 0);
  WorldOptions options;
  options.boards = {"bord"};
  try {
    TankWorld::from_scene(scene, options);
    FAIL() << "a board that is not there was shown";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("found no board called bord, expected one of: board"));
  }
}

TEST(TrueRig, DiffersBySeedAndStaysTheSameForOne) {
  const Scene scene = full_scene();
  TrueRig truth;
  truth.camera_moved = 0.03, truth.camera_turned = 0.05, truth.eye_moved = 0.002, truth.focal = 0.02;
  truth.joint_zero = 0.02, truth.laser_turned = 0.03, truth.object_moved = 0.02;
  const Scene one = as_built(scene, truth), again = as_built(scene, truth);
  truth.seed = 2;
  const Scene two = as_built(scene, truth);
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    const double moved = (one.cameras[i].wMc.translation() - scene.cameras[i].wMc.translation()).norm();
    EXPECT_EQ(one.cameras[i].wMc.matrix(), again.cameras[i].wMc.matrix());
    EXPECT_NE(one.cameras[i].wMc.matrix(), two.cameras[i].wMc.matrix());
    if (scene.cameras[i].name != "right") {
      EXPECT_GE(moved, 0.75 * 0.03 - 1e-9);
      EXPECT_LE(moved, 1.25 * 0.03 + 1e-9);
    }
    EXPECT_NEAR(one.cameras[i].model.fx / scene.cameras[i].model.fx, 1, 0.02);
  }
  const Transform before = scene.cameras[1].wMc.inverse() * scene.cameras[2].wMc,
                  after = one.cameras[1].wMc.inverse() * one.cameras[2].wMc;
  EXPECT_LT((before.translation() - after.translation()).norm(), 0.003) << "both eyes stand on one bar";
  EXPECT_NE(one.arm.model.dh[1].theta0, scene.arm.model.dh[1].theta0);
  EXPECT_EQ(one.arm.wMb.matrix(), scene.arm.wMb.matrix());
  EXPECT_EQ(as_built(scene, TrueRig{}).cameras[0].wMc.matrix(), scene.cameras[0].wMc.matrix());
}

}  // namespace
}  // namespace tankrig::sim::testing
