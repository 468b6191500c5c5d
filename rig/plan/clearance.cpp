#include "rig/plan/clearance.hpp"

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/distance.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/input_error.hpp"
#include "rig/plan/nearest_points.hpp"

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

std::vector<Vector3d> corners_of(const Box& box) {
  std::vector<Vector3d> corners;
  for (const double x : {-0.5, 0.5})
    for (const double y : {-0.5, 0.5})
      for (const double z : {-0.5, 0.5}) corners.push_back(box.xMbox * box.size.cwiseProduct(Vector3d(x, y, z)));
  return corners;
}

std::unique_ptr<Triangles> skin_of(const Box& box) {
  return triangles_of(corners_of(box), {{0, 1, 2},
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
  std::unique_ptr<Triangles> triangles{};
  std::vector<Vector3d> corners{};  // of a solid box, or the ends of a capsule's axis
  double radius = 0;
  std::optional<Box> solid{};
  std::optional<Plane> plane{};             // the arm is on its normal's side
  JointVector reach = JointVector::Zero();  // farthest of its corners from each joint's axis, whatever the posture [m]

  /// Whether a body lies in this solid box, once their skins do not meet. `xMother`: it in this one's frame.
  bool holds(const Body& other, const Transform& xMother) const {
    return solid && !other.corners.empty() && is_inside(xMother * other.corners.front(), *solid);
  }
};

/// Of link `number`, 1 to 4, at joint angle 0.
Transform link_transform(const ArmModel& arm, int number) {
  const DhLink& link = arm.dh[static_cast<std::size_t>(number - 1)];
  return Eigen::Translation3d(link.a, 0, link.d) * Eigen::AngleAxisd(link.alpha, Vector3d::UnitX());
}

JointVector reach_of(const ArmModel& arm, int link, const std::vector<Vector3d>& corners) {
  JointVector reach = JointVector::Zero();
  for (const Vector3d& corner : corners) {
    const Vector3d p = link_transform(arm, link) * corner;
    reach[link - 1] = std::max(reach[link - 1], std::hypot(p.x(), p.y()));
    double beyond = p.norm();
    for (int j = link - 2; j >= 0; --j) {
      beyond += link_transform(arm, j + 1).translation().norm();
      reach[j] = std::max(reach[j], beyond);
    }
  }
  return reach;
}

Body body_of(const std::string& name, const Shape& shape) {
  if (const Box* const box = std::get_if<Box>(&shape))
    return {.name = name, .triangles = skin_of(*box), .corners = corners_of(*box), .solid = *box};
  const auto& capsule = std::get<Capsule>(shape);
  return {.name = name, .triangles = axis_of(capsule), .corners = {capsule.a, capsule.b}, .radius = capsule.radius};
}

Body moved_body(const ArmModel& arm, const std::string& name, int link, const Shape& shape) {
  Body body = body_of(name, shape);
  body.link = link;
  body.reach = reach_of(arm, link, body.corners);
  return body;
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

/// Of Clearance, and of whoever asks where two bodies are nearest.
struct ClearanceModel {
  struct Pair {
    PairKind kind;
    std::size_t obstacle, body;  // the body is moved by every joint that moves the obstacle
  };

  ClearanceModel(const ArmModel& arm, const Obstacles& obstacles);

  ArmModel arm;
  std::vector<Body> bodies{};
  std::vector<Pair> pairs{};

  std::size_t add(Body body) {
    bodies.push_back(std::move(body));
    return bodies.size() - 1;
  }
  std::size_t add_link(const char* name, int link, const Obstacles& o, const Vector3d& end = Vector3d::Zero()) {
    const Vector3d begin = link_transform(arm, link).inverse().translation();
    return add(moved_body(arm, name, link, Capsule{begin, end, o.link_radius}));
  }
  std::string name(const Pair& p) const { return bodies[p.obstacle].name + ": " + bodies[p.body].name; }
  /// The forearm without what is near the elbow.
  Body forearm_beyond_elbow(const Body& forearm) const {
    const double near = Clearance::kElbowRadii * forearm.radius, aside = link_transform(arm, 3).translation().norm();
    const Vector3d &elbow = forearm.corners[0], &end = forearm.corners[1], way = end - elbow;
    const double left_out = std::min(std::sqrt(std::max(0.0, near * near - aside * aside)), way.norm());
    return moved_body(arm, forearm.name, forearm.link,
                      Capsule{elbow + left_out * way.normalized(), end, forearm.radius});
  }
};

ClearanceModel::ClearanceModel(const ArmModel& of, const Obstacles& o) : arm(of) {
  ClearanceModel& m = *this;
  const std::size_t slew_link = m.add_link("slew link", 1, o), upper_arm = m.add_link("upper arm", 2, o),
                    elbow = m.add_link("elbow", 3, o),
                    forearm = m.add_link("forearm", 4, o, o.tool_length * Vector3d::UnitZ());
  for (const auto& [name, shape] : o.carried) m.add(moved_body(arm, name, 4, shape));
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
  for (const auto& [name, box] : o.cameras) against_all(PairKind::kCamera, body_of("camera " + name, box));
  for (const auto& [name, shape] : o.fixed) against_all(PairKind::kFrame, body_of(name, shape));

  const auto against_itself = [&](std::size_t nearer, std::size_t body) {
    m.pairs.push_back({PairKind::kArm, nearer, body});
  };
  const std::size_t base = m.add(body_of("base", o.base));
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

struct Clearance::Model : ClearanceModel {
  using ClearanceModel::ClearanceModel;
};

Clearance::Clearance(const ArmModel& arm, const Obstacles& o) : model_(std::make_unique<Model>(arm, o)) {}

Clearance::~Clearance() = default;

std::size_t Clearance::pairs() const noexcept { return model_->pairs.size(); }

PairKind Clearance::kind(std::size_t pair) const { return model_->pairs[pair].kind; }

std::string Clearance::name(std::size_t pair) const { return model_->name(model_->pairs[pair]); }

double Clearance::at(std::size_t pair, const JointVector& q) const {
  const Model::Pair& p = model_->pairs[pair];
  const Body &obstacle = model_->bodies[p.obstacle], &body = model_->bodies[p.body];
  const auto frames = model_->arm.link_frames(q);
  const auto bMlink = [&](int link) {
    return link == 0 ? Transform::Identity() : frames[static_cast<std::size_t>(link - 1)];
  };
  const Transform bMbody = bMlink(body.link), bMobstacle = bMlink(obstacle.link);
  if (obstacle.plane) {
    double nearest = HUGE_VAL;
    for (const Vector3d& corner : body.corners) nearest = std::min(nearest, obstacle.plane->distance(bMbody * corner));
    return nearest - body.radius;
  }
  const double radii = obstacle.radius + body.radius;
  const Transform obstacleMbody = bMobstacle.inverse() * bMbody;
  if (obstacle.holds(body, obstacleMbody) || body.holds(obstacle, obstacleMbody.inverse())) return -radii;
  fcl::DistanceResultd result;
  const double distance = fcl::distance(obstacle.triangles.get(), bMobstacle, body.triangles.get(), bMbody,
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

NearestPoints nearest_points(const ArmModel& arm, const Obstacles& obstacles, const std::string& pair,
                             const JointVector& q) {
  const ClearanceModel model(arm, obstacles);
  const auto found = std::ranges::find_if(model.pairs, [&](const auto& p) { return model.name(p) == pair; });
  if (found == model.pairs.end()) throw InputError("clearance: found no pair '" + pair + "'");
  const Body &obstacle = model.bodies[found->obstacle], &body = model.bodies[found->body];
  const auto frames = arm.link_frames(q);
  const auto bMlink = [&](int link) {
    return link == 0 ? Transform::Identity() : frames[static_cast<std::size_t>(link - 1)];
  };
  const Transform bMbody = bMlink(body.link);
  if (obstacle.plane) {
    const auto distance = [&](const Vector3d& corner) { return obstacle.plane->distance(bMbody * corner); };
    const Vector3d nearest = bMbody * *std::ranges::min_element(body.corners, {}, distance);
    const Vector3d& away = obstacle.plane->normal;
    return {nearest - obstacle.plane->distance(nearest) * away, nearest - body.radius * away};
  }
  fcl::DistanceRequestd request;
  request.enable_nearest_points = true;
  fcl::DistanceResultd result;
  fcl::distance(obstacle.triangles.get(), bMlink(obstacle.link), body.triangles.get(), bMbody, request, result);
  const Vector3d &there = result.nearest_points[0], &here = result.nearest_points[1];
  const Vector3d way = (here - there).normalized();
  return {there + obstacle.radius * way, here - body.radius * way};
}

}  // namespace tankrig
