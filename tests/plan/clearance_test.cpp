#include "rig/plan/clearance.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/input_error.hpp"
#include "rig/plan/nearest_points.hpp"

namespace tankrig {
namespace {

/// Random numbers that are the same in every run, in [-1, 1].
struct Chance {
  explicit Chance(unsigned seed) : random(seed) {}
  double operator()() { return uniform(random); }
  Vector3d point() { return {(*this)(), (*this)(), (*this)()}; }

  std::mt19937 random;
  std::uniform_real_distribution<double> uniform{-1, 1};
};

/// An arm without links: e is b at joint angle 0, so what it carries is where the test says.
const ArmModel kNoArm{};

/// Of the pair with this name.
double clearance(const ArmModel& arm, const Obstacles& o, const std::string& name,
                 const JointVector& q = JointVector::Zero()) {
  const Clearance sut(arm, o);
  for (std::size_t pair = 0; pair < sut.pairs(); ++pair)
    if (sut.name(pair) == name) return sut.at(pair, q);
  ADD_FAILURE() << "no pair " << name;
  return NAN;
}

double clearance(const Shape& probe, const Shape& thing) {
  Obstacles o;
  o.carried = {{"probe", probe}};
  o.fixed = {{"thing", thing}};
  return clearance(kNoArm, o, "thing: probe");
}

/// The least value of a convex f on [0, 1].
template <class F>
double least(F f) {
  double low = 0, high = 1;
  for (int i = 0; i < 100; ++i) {
    const double t1 = low + (high - low) / 3, t2 = high - (high - low) / 3;
    (f(t1) <= f(t2) ? high : low) = f(t1) <= f(t2) ? t2 : t1;
  }
  return f(0.5 * (low + high));
}

/// Distance of p from the segment c-d.
double point_segment(const Vector3d& p, const Vector3d& c, const Vector3d& d) {
  const Vector3d way = d - c;
  const double t = way.isZero() ? 0 : std::clamp((p - c).dot(way) / way.squaredNorm(), 0.0, 1.0);
  return (p - c - t * way).norm();
}

/// Distance of p from the solid box.
double point_box(const Vector3d& p, const Box& box) {
  return ((box.xMbox.inverse() * p).cwiseAbs() - 0.5 * box.size).cwiseMax(0.0).norm();
}

TEST(CapsuleToCapsule, IsTheClosedFormsDistance) {
  constexpr unsigned kSeed = 3;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  Chance chance(kSeed);
  for (int trial = 0; trial < 3000; ++trial) {
    const Vector3d a = chance.point(), b = chance.point(), c = chance.point();
    const Vector3d d = trial % 3 == 0   ? chance.point()
                       : trial % 3 == 1 ? Vector3d(c + chance() * (b - a))            // parallel
                                        : Vector3d(c + 2 * (a + 0.3 * (b - a) - c));  // they cross
    const double axes = least([&](double t) { return point_segment(a + t * (b - a), c, d); });
    EXPECT_NEAR(clearance(Capsule{a, b, 0.03}, Capsule{c, d, 0.05}), axes - 0.08, 1e-6) << trial;
  }
}

TEST(CapsuleToCapsule, TellsWhatCanBeReadOffARuler) {
  const Capsule upright{{0, 0, 0}, {0, 0, 1}, 0.1};
  EXPECT_NEAR(clearance(Capsule{{0.5, 0, 0.2}, {0.5, 0, 0.9}, 0.05}, upright), 0.35, 1e-6) << "side by side";
  EXPECT_NEAR(clearance(Capsule{{0, 0, 1.5}, {0, 0, 2}, 0.05}, upright), 0.35, 1e-6) << "end to end";
  EXPECT_NEAR(clearance(Capsule{{-1, 0.3, 0.5}, {1, 0.3, 0.5}, 0.05}, upright), 0.15, 1e-6) << "crossing";
  EXPECT_NEAR(clearance(Capsule{{0.3, 0.4, 0.5}, {0.3, 0.4, 0.5}, 0.05}, upright), 0.35, 1e-6) << "a ball";
  EXPECT_NEAR(clearance(Capsule{{-1, 0, 0.5}, {1, 0, 0.5}, 0.05}, upright), -0.15, 1e-6) << "through each other";
}

TEST(CapsuleToBox, IsTheDistanceFromTheSolidBox) {
  constexpr unsigned kSeed = 11;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  Chance chance(kSeed);
  for (int trial = 0; trial < 3000; ++trial) {
    const Vector3d turn = trial % 2 == 0 ? Vector3d(3 * chance.point()) : Vector3d::Zero();
    const Box box{make_transform_rpy(0.5 * chance.point(), turn), {0.14, 0.30, 0.16}};
    const Vector3d a = chance.point(), b = trial % 3 == 0 ? Vector3d(a + 0.1 * chance.point()) : chance.point();
    const double outside = least([&](double t) { return point_box(a + t * (b - a), box); });
    EXPECT_NEAR(clearance(Capsule{a, b, 0.03}, box), outside - 0.03, 1e-6) << trial;
  }
}

TEST(CapsuleToBox, TellsWhatCanBeReadOffARuler) {
  const Box cube{Transform::Identity(), {0.2, 0.2, 0.2}};
  EXPECT_NEAR(clearance(Capsule{{-1, 0, 0.4}, {1, 0, 0.4}, 0.05}, cube), 0.25, 1e-6) << "along a face";
  EXPECT_NEAR(clearance(Capsule{{0.4, 0.5, 0}, {0.4, 0.9, 0}, 0.05}, cube), 0.45, 1e-6) << "off an edge";
  EXPECT_NEAR(clearance(Capsule{{0.01, 0, 0}, {0.02, 0, 0}, 0.05}, cube), -0.05, 1e-6) << "wholly inside";
}

TEST(CarriedBox, IsAsFarAsIfItStoodAndTheOtherWereCarried) {
  constexpr unsigned kSeed = 17;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  Chance chance(kSeed);
  for (int trial = 0; trial < 1000; ++trial) {
    const Box plate{make_transform_rpy(0.5 * chance.point(), 3 * chance.point()), {0.15, 0.10, 0.01}};
    const Capsule rod{chance.point(), chance.point(), 0.03};
    EXPECT_NEAR(clearance(plate, rod), clearance(rod, plate), 1e-9) << trial;
  }
}

TEST(CarriedBox, TellsWhatCanBeReadOffARuler) {
  const Box cube{Transform::Identity(), {0.2, 0.2, 0.2}};
  EXPECT_NEAR(clearance(cube, Box{make_transform_rpy({0.5, 0, 0}, Vector3d::Zero()), {0.2, 1, 1}}), 0.3, 1e-6);
  EXPECT_NEAR(clearance(cube, Capsule{{0.01, 0, 0}, {0.02, 0, 0}, 0.05}), -0.05, 1e-6) << "wholly inside";
  EXPECT_NEAR(clearance(Box{Transform::Identity(), {0.1, 0.1, 0.1}}, cube), 0, 1e-6) << "wholly inside";
  Obstacles o;
  o.tank_size = {2, 2, 1.5};
  o.wMb = make_transform_rpy({0, 0, 0.5}, Vector3d::Zero());
  o.carried = {{"plate", Box{make_transform_rpy({0, 0, -0.2}, {0.3, 0, 0}), {0.2, 0.1, 0.01}}}};
  const double corner = 0.05 * std::sin(0.3) + 0.005 * std::cos(0.3);
  EXPECT_NEAR(clearance(kNoArm, o, "floor: plate"), 0.3 - corner, 1e-12);
}

TEST(ObjectsSurface, LeavesFreeWhatItsBoundingBoxDoesNot) {
  Obstacles o;
  // Two walls of a corner, 0.4 m long and high; the probe stands in it.
  o.object.vertices = {{0, 0, 0}, {0.4, 0, 0}, {0, 0.4, 0}, {0, 0, 0.4}, {0.4, 0, 0.4}, {0, 0.4, 0.4}};
  o.object.triangles = {{0, 1, 3}, {1, 4, 3}, {0, 3, 2}, {2, 3, 5}};
  o.carried = {{"probe", Capsule{{0.2, 0.3, 0.1}, {0.2, 0.3, 0.3}, 0.05}}};
  EXPECT_NEAR(clearance(kNoArm, o, "object: probe"), 0.15, 1e-6);
}

TEST(FloorAndWalls, AreAsFarAsTheTankSays) {
  Obstacles o;
  o.tank_size = {2, 1.6, 1.5};
  o.wMb = make_transform_rpy({0.2, -0.1, 1.2}, {M_PI, 0, 0});  // w's y and z are minus b's
  o.carried = {{"probe", Capsule{{0.3, 0.1, 0.2}, {0.4, 0.3, 0.7}, 0.05}}};
  EXPECT_NEAR(clearance(kNoArm, o, "floor: probe"), 0.45, 1e-12);
  EXPECT_NEAR(clearance(kNoArm, o, "wall +x: probe"), 0.35, 1e-12);
  EXPECT_NEAR(clearance(kNoArm, o, "wall -x: probe"), 1.45, 1e-12);
  EXPECT_NEAR(clearance(kNoArm, o, "wall -y: probe"), 0.35, 1e-12);
  EXPECT_NEAR(clearance(kNoArm, o, "wall +y: probe"), 0.95, 1e-12);
}

TEST(ArmItself, IsCheckedButWhereItsLinksAreJoined) {
  Obstacles o;
  o.carried = {{"projector", Capsule{{-0.1, 0, -0.3}, {-0.1, 0, -0.2}, 0.03}}};
  const Clearance sut(arm5e(), o);
  std::vector<std::string> names;
  for (std::size_t pair = 0; pair < sut.pairs(); ++pair)
    if (sut.kind(pair) == PairKind::kArm) names.push_back(sut.name(pair));
  EXPECT_THAT(names, testing::UnorderedElementsAre("base: elbow", "base: forearm", "base: projector",
                                                   "slew link: elbow", "slew link: forearm", "slew link: projector",
                                                   "upper arm: forearm", "upper arm: projector", "elbow: projector"));
}

TEST(ArmItself, IsAsNearAsItsLinksAreByTheArmsGeometry) {
  // Upper arm and forearm in one line: the projector, 0.1 m beside the forearm and turned to the side, is level with it.
  ArmModel arm = arm5e();
  arm.dh[2] = {0, M_PI / 2, 0, M_PI / 2};
  Obstacles o;
  o.carried = {{"projector", Capsule{{0, 0.1, -0.3}, {0, 0.1, -0.2}, 0.03}}};
  const double ahead = arm.dh[3].d - 0.3;  // of the elbow
  EXPECT_NEAR(clearance(arm, o, "upper arm: projector"), std::hypot(ahead, 0.1) - 0.045 - 0.03, 1e-6);
  EXPECT_NEAR(clearance(arm, o, "upper arm: forearm"), Clearance::kElbowRadii * 0.045 - 2 * 0.045, 1e-6);
}

TEST(ArmItself, DoesNotMeetItselfWithinItsLimits) {
  constexpr unsigned kSeed = 5;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  Chance chance(kSeed);
  const ArmModel arm = arm5e();
  const Clearance sut(arm, {});
  for (int trial = 0; trial < 5000; ++trial) {
    JointVector q;
    for (int j = 0; j < kJoints; ++j)
      q[j] = arm.limits[j].lower + 0.5 * (1 + chance()) * (arm.limits[j].upper - arm.limits[j].lower);
    for (std::size_t pair = 0; pair < sut.pairs(); ++pair) {
      if (sut.kind(pair) != PairKind::kArm) continue;
      EXPECT_GT(sut.at(pair, q), 0.05) << sut.name(pair) << " at " << q.transpose();
    }
  }
}

TEST(ClosingSpeed, BoundsEveryPairInEveryPosture) {
  constexpr unsigned kSeed = 29;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  Chance chance(kSeed);
  const ArmModel arm = arm5e();
  Obstacles o;
  o.wMb = make_transform_rpy({0, 0, 1.2}, {M_PI, 0, 0});
  o.tool_length = 0.1;
  o.carried = {{"projector", Capsule{{-0.1, 0, -0.3}, {-0.1, 0.02, -0.2}, 0.03}},
               {"plate", Box{make_transform_rpy({0.1, 0, 0.04}, {0.3, 0.4, 0.5}), {0.15, 0.15, 0.01}}}};
  o.cameras = {{"mono", {make_transform_rpy({0.6, 0.2, 0.5}, {0.3, 0.4, 0.5}), {0.06, 0.06, 0.1}}}};
  o.fixed = {{"post", Capsule{{0.6, -0.3, -0.3}, {0.6, -0.3, 0.5}, 0.02}}};
  const Clearance sut(arm, o);
  double closest_to_bound = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    JointVector q, velocity;
    for (int j = 0; j < kJoints; ++j) {
      q[j] = 3 * chance();
      velocity[j] = chance() > 0 ? chance() : 0;
    }
    constexpr double kTime = 0.01;
    for (std::size_t pair = 0; pair < sut.pairs(); ++pair) {
      const double moved = std::abs(sut.at(pair, q + kTime * velocity) - sut.at(pair, q));
      const double bound = kTime * sut.closing_speed(pair, velocity);
      EXPECT_LE(moved, bound + 3e-7) << sut.name(pair);
      if (bound > 1e-4) closest_to_bound = std::max(closest_to_bound, moved / bound);
    }
  }
  EXPECT_GT(closest_to_bound, 0.9) << "a bound that is never neared wastes looks";
}

TEST(NearestPoints, AreAsFarApartAsTheClearanceOfEveryPair) {
  constexpr unsigned kSeed = 7;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  Chance chance(kSeed);
  const ArmModel arm = arm5e();
  Obstacles o;
  o.wMb = Transform(Eigen::Translation3d(0.1, 0, 1.4) * Eigen::AngleAxisd(3.1, Vector3d::UnitX()));
  o.fixed = {{"post", Capsule{{0.9, 0.3, 0}, {0.9, 0.3, 1}, 0.03}},
             {"box", Box{Transform(Eigen::Translation3d(0.2, -0.8, 0.5)), {0.2, 0.3, 0.4}}}};
  o.carried = {{"projector", Capsule{{0, 0.1, 0}, {0.05, 0.15, 0.1}, 0.02}}};
  const Clearance clearance(arm, o);
  int apart = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const JointVector q = JointVector::NullaryExpr([&] { return chance(); });
    for (std::size_t pair = 0; pair < clearance.pairs(); ++pair) {
      const double distance = clearance.at(pair, q);
      if (distance <= 0) continue;
      const NearestPoints found = nearest_points(arm, o, clearance.name(pair), q);
      EXPECT_NEAR((found.obstacle - found.body).norm(), distance, 1e-6) << clearance.name(pair) << ", trial " << trial;
      ++apart;
    }
  }
  EXPECT_GT(apart, 500);
}

TEST(NearestPoints, LieWhereARulerFindsThem) {
  Obstacles o;
  o.carried = {{"probe", Capsule{{0, 0, 0}, {0, 0, 1}, 0.1}}};
  o.fixed = {{"thing", Box{Transform(Eigen::Translation3d(1, 0, 1.5)), {1, 1, 1}}}};
  const NearestPoints found = nearest_points(kNoArm, o, "thing: probe", JointVector::Zero());
  EXPECT_NEAR(found.obstacle.x(), 0.5, 1e-6);
  EXPECT_NEAR(found.body.x(), 0.1, 1e-6);
  EXPECT_NEAR(found.body.z(), 1, 1e-6);
  EXPECT_THROW(nearest_points(kNoArm, o, "thing: nobody", JointVector::Zero()), InputError);
}

}  // namespace
}  // namespace tankrig
