#include "rig/plan/clearance.hpp"

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/distance.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace tankrig {
namespace {

using Triangles = fcl::BVHModel<fcl::OBBRSSd>;

std::unique_ptr<Triangles> triangles_of(const std::vector<Vector3d>& vertices,
                                        const std::vector<fcl::Triangle>& triangles) {
  auto model = std::make_unique<Triangles>();
  model->beginModel(static_cast<int>(triangles.size()), static_cast<int>(vertices.size()));
  model->addSubModel(vertices, triangles);
  model->endModel();
  return model;
}

/// Without any width, FCL takes parallel axes for ones that meet.
constexpr double kAxisWidth = 1e-7;

std::unique_ptr<Triangles> axis_of(const Capsule& c) {
  const Vector3d way = c.b - c.a;
  const Vector3d aside = way.isZero() ? Vector3d::UnitX() : way.unitOrthogonal();
  return triangles_of({c.a, c.b, c.b + kAxisWidth * aside}, {{0, 1, 2}});
}

std::unique_ptr<Triangles> skin_of(const Box& box) {
  std::vector<Vector3d> corners;
  for (const double x : {-0.5, 0.5})
    for (const double y : {-0.5, 0.5})
      for (const double z : {-0.5, 0.5}) corners.push_back(box.xMbox * box.size.cwiseProduct(Vector3d(x, y, z)));
  return triangles_of(corners, {{0, 1, 2},
                                {1, 3, 2},
                                {4, 6, 5},
                                {5, 6, 7},
                                {0, 4, 1},
                                {1, 4, 5},
                                {2, 3, 6},
                                {3, 7, 6},
                                {0, 2, 4},
                                {2, 6, 4},
                                {1, 5, 3},
                                {3, 5, 7}});
}

bool is_inside(const Vector3d& p, const Box& box) {
  return ((box.xMbox.inverse() * p).cwiseAbs() - 0.5 * box.size).maxCoeff() < 0;
}

/// Triangles thickened by a radius, moved by the first `link` joints and given in the frame after them; or a plane.
struct Body {
  std::string name;
  int link = 0;
  Capsule axis{};
  std::unique_ptr<Triangles> triangles{};
  std::optional<Box> solid{};
  std::optional<Plane> plane{};             // the arm is on its normal's side
  JointVector reach = JointVector::Zero();  // farthest of its axis from each joint's axis, whatever the posture [m]
};

/// Of link `number`, 1 to 4, at joint angle 0.
Transform link_transform(const ArmModel& arm, int number) {
  const DhLink& link = arm.dh[static_cast<std::size_t>(number - 1)];
  return Eigen::Translation3d(link.a, 0, link.d) * Eigen::AngleAxisd(link.alpha, Vector3d::UnitX());
}

JointVector reach_of(const ArmModel& arm, int link, const Capsule& axis) {
  JointVector reach = JointVector::Zero();
  for (const Vector3d& end : {axis.a, axis.b}) {
    const Vector3d p = link_transform(arm, link) * end;
    reach[link - 1] = std::max(reach[link - 1], std::hypot(p.x(), p.y()));
    double beyond = p.norm();
    for (int j = link - 2; j >= 0; --j) {
      beyond += link_transform(arm, j + 1).translation().norm();
      reach[j] = std::max(reach[j], beyond);
    }
  }
  return reach;
}

Body fixed_capsule(const std::string& name, const Capsule& c) {
  return {.name = name, .axis = c, .triangles = axis_of(c)};
}

Body fixed_box(const std::string& name, const Box& box) {
  return {.name = name, .triangles = skin_of(box), .solid = box};
}

Body moved_capsule(const ArmModel& arm, const std::string& name, int link, const Capsule& c) {
  return {.name = name, .link = link, .axis = c, .triangles = axis_of(c), .reach = reach_of(arm, link, c)};
}

std::vector<Body> walls(const Obstacles& o) {
  std::vector<Body> bodies;
  const auto add = [&](const char* name, const Vector3d& normal, double offset) {
    bodies.push_back({.name = name, .plane = o.wMb.inverse() * Plane{normal, offset}});
  };
  add("floor", Vector3d::UnitZ(), 0);
  add("wall -x", Vector3d::UnitX(), 0.5 * o.tank_size.x());
  add("wall +x", -Vector3d::UnitX(), 0.5 * o.tank_size.x());
  add("wall -y", Vector3d::UnitY(), 0.5 * o.tank_size.y());
  add("wall +y", -Vector3d::UnitY(), 0.5 * o.tank_size.y());
  return bodies;
}

}  // namespace

struct Clearance::Model {
  struct Pair {
    PairKind kind;
    std::size_t obstacle, body;  // the body is moved by every joint that moves the obstacle
  };

  ArmModel arm;
  std::vector<Body> bodies{};
  std::vector<Pair> pairs{};

  std::size_t add(Body body) {
    bodies.push_back(std::move(body));
    return bodies.size() - 1;
  }
  std::size_t add_link(const char* name, int link, const Obstacles& o, const Vector3d& end = Vector3d::Zero()) {
    const Vector3d begin = link_transform(arm, link).inverse().translation();
    return add(moved_capsule(arm, name, link, {begin, end, o.link_radius}));
  }
  /// The forearm without what is near the elbow.
  Body forearm_beyond_elbow(const Body& forearm) const {
    const double near = kElbowRadii * forearm.axis.radius, aside = link_transform(arm, 3).translation().norm();
    const Vector3d way = forearm.axis.b - forearm.axis.a;
    const double left_out = std::min(std::sqrt(std::max(0.0, near * near - aside * aside)), way.norm());
    return moved_capsule(arm, forearm.name, forearm.link,
                         {forearm.axis.a + left_out * way.normalized(), forearm.axis.b, forearm.axis.radius});
  }
};

Clearance::Clearance(const ArmModel& arm, const Obstacles& o) : model_(new Model{arm}) {
  Model& m = *model_;
  const std::size_t slew_link = m.add_link("slew link", 1, o), upper_arm = m.add_link("upper arm", 2, o),
                    elbow = m.add_link("elbow", 3, o),
                    forearm = m.add_link("forearm", 4, o, o.tool_length * Vector3d::UnitZ());
  for (const auto& [name, shape] : o.carried) m.add(moved_capsule(arm, name, 4, shape));
  const std::size_t moved = m.bodies.size();

  const auto against_all = [&](PairKind kind, Body body) {
    const std::size_t obstacle = m.add(std::move(body));
    for (std::size_t i = 0; i < moved; ++i) m.pairs.push_back({kind, obstacle, i});
  };
  if (!o.object.triangles.empty()) {
    std::vector<fcl::Triangle> triangles;
    for (const Eigen::Vector3i& t : o.object.triangles)
      triangles.emplace_back(static_cast<std::size_t>(t[0]), static_cast<std::size_t>(t[1]),
                             static_cast<std::size_t>(t[2]));
    against_all(PairKind::kObject, {.name = "object", .triangles = triangles_of(o.object.vertices, triangles)});
  }
  for (Body& wall : walls(o)) against_all(PairKind::kTank, std::move(wall));
  for (const auto& [name, box] : o.cameras) against_all(PairKind::kCamera, fixed_box("camera " + name, box));
  for (const auto& [name, shape] : o.fixed)
    against_all(PairKind::kFrame, std::holds_alternative<Box>(shape) ? fixed_box(name, std::get<Box>(shape))
                                                                     : fixed_capsule(name, std::get<Capsule>(shape)));

  const auto against_itself = [&](std::size_t nearer, std::size_t body) {
    m.pairs.push_back({PairKind::kArm, nearer, body});
  };
  const std::size_t base = m.add(fixed_capsule("base", o.base));
  for (std::size_t body = elbow; body < moved; ++body) {
    against_itself(base, body);
    against_itself(slew_link, body);
  }
  against_itself(upper_arm, m.add(m.forearm_beyond_elbow(m.bodies[forearm])));
  for (std::size_t body = forearm + 1; body < moved; ++body) {
    against_itself(upper_arm, body);
    against_itself(elbow, body);
  }
}

Clearance::~Clearance() = default;

std::size_t Clearance::pairs() const noexcept { return model_->pairs.size(); }

PairKind Clearance::kind(std::size_t pair) const { return model_->pairs[pair].kind; }

std::string Clearance::name(std::size_t pair) const {
  const Model::Pair& p = model_->pairs[pair];
  return model_->bodies[p.obstacle].name + ": " + model_->bodies[p.body].name;
}

double Clearance::at(std::size_t pair, const JointVector& q) const {
  const Model::Pair& p = model_->pairs[pair];
  const Body &obstacle = model_->bodies[p.obstacle], &body = model_->bodies[p.body];
  const auto frames = model_->arm.link_frames(q);
  const auto bMlink = [&](int link) {
    return link == 0 ? Transform::Identity() : frames[static_cast<std::size_t>(link - 1)];
  };
  const Transform bMbody = bMlink(body.link);
  const Vector3d begin = bMbody * body.axis.a;
  if (obstacle.plane)
    return std::min(obstacle.plane->distance(begin), obstacle.plane->distance(bMbody * body.axis.b)) - body.axis.radius;
  const double radii = obstacle.axis.radius + body.axis.radius;
  if (obstacle.solid && is_inside(begin, *obstacle.solid)) return -radii;
  fcl::DistanceResultd result;
  const double distance = fcl::distance(obstacle.triangles.get(), bMlink(obstacle.link), body.triangles.get(), bMbody,
                                        fcl::DistanceRequestd(), result);
  return std::max(0.0, distance) - radii;
}

double Clearance::closing_speed(std::size_t pair, const JointVector& velocity) const {
  const Model::Pair& p = model_->pairs[pair];
  const Body& body = model_->bodies[p.body];
  double speed = 0;
  for (int j = model_->bodies[p.obstacle].link; j < body.link; ++j) speed += body.reach[j] * std::abs(velocity[j]);
  return speed;
}

}  // namespace tankrig
