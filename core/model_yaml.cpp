#include "core/model_yaml.hpp"

#include <cmath>
#include <initializer_list>

#include "core/camera_ranges.hpp"
#include "core/text_files.hpp"

namespace tankrig {
namespace {

template <class Values>
std::string list(const Values& values) {
  std::string out = "[";
  for (const double v : values) out += (out.size() > 1 ? ", " : "") + exact_text(v);
  return out + "]";
}

struct Field {
  const char* name;
  double value;
};

std::string mapping(std::initializer_list<Field> fields) {
  std::string out = "{";
  for (const Field& f : fields) out += (out.size() > 1 ? ", " : "") + std::string(f.name) + ": " + exact_text(f.value);
  return out + "}";
}

std::string yaml_of(const Actuator& a) {
  if (a.d == 0) return mapping({{"rad_per_tick", a.rad_per_tick}});
  return mapping({{"d_m", a.d},
                  {"r_m", a.r},
                  {"l_min_m", a.l_min},
                  {"m_per_tick", a.m_per_tick},
                  {"alpha0_rad", a.alpha0},
                  {"q0_rad", a.q0},
                  {"sign", static_cast<double>(a.sign)}});
}

constexpr double kTiny = 1e-12;

Actuator read_actuator(const ConfigNode& node) {
  Actuator a;
  if (node.has("rad_per_tick")) {
    a.rad_per_tick = node.number("rad_per_tick");
    if (a.rad_per_tick == 0) node.fail("rad_per_tick", "found 0, expected another number");
    return a;
  }
  a.d = node.number("d_m", {kTiny, 10});
  a.r = node.number("r_m", {kTiny, 10});
  a.l_min = node.number("l_min_m", {kTiny, 10});
  a.m_per_tick = node.number("m_per_tick", {kTiny, 1});
  a.alpha0 = node.number("alpha0_rad", {-7, 7});
  a.q0 = node.number("q0_rad", {-7, 7});
  a.sign = node.integer("sign", {-1, 1});
  if (a.sign == 0) node.fail("sign", "found '0', expected 1 or -1");
  return a;
}

}  // namespace

std::string yaml_of(const Vector3d& v) { return list(v); }
std::string yaml_of(const JointVector& q) { return list(q); }

std::string yaml_of(const Transform& aMb) {
  return "{translation_m: " + list(Vector3d(aMb.translation())) + ", quaternion_xyzw: " + list(quaternion_xyzw(aMb)) +
         "}";
}

std::string yaml_of(const Plane& plane) {
  return "{normal: " + list(plane.normal) + ", offset_m: " + exact_text(plane.offset) + "}";
}

std::string yaml_of(const CameraModel& c) {
  return mapping({{"width_px", static_cast<double>(c.width)},
                  {"height_px", static_cast<double>(c.height)},
                  {"fx_px", c.fx},
                  {"fy_px", c.fy},
                  {"cx_px", c.cx},
                  {"cy_px", c.cy},
                  {"k1", c.k1},
                  {"k2", c.k2},
                  {"p1", c.p1},
                  {"p2", c.p2},
                  {"k3", c.k3}});
}

std::string yaml_of(const ArmModel& arm, int indent) {
  const std::string margin(static_cast<std::size_t>(indent), ' ');
  std::string out = margin + "dh:\n";
  for (const DhLink& link : arm.dh)
    out += margin + "  - " +
           mapping({{"a_m", link.a}, {"alpha_rad", link.alpha}, {"d_m", link.d}, {"theta0_rad", link.theta0}}) + "\n";
  out += margin + "limits_rad:\n";
  for (int i = 0; i < kJoints; ++i)
    out += margin + "  " + kJointNames[i] + ": " + list(std::array{arm.limits[i].lower, arm.limits[i].upper}) + "\n";
  out += margin + "actuators:\n";
  for (int i = 0; i < kJoints; ++i) out += margin + "  " + kJointNames[i] + ": " + yaml_of(arm.actuators[i]) + "\n";
  return out;
}

Vector3d read_vector(const ConfigNode& node, std::string_view key) {
  const std::vector<double> v = node.numbers(key, 3);
  return {v[0], v[1], v[2]};
}

JointVector read_joints(const ConfigNode& node, std::string_view key) {
  const std::vector<double> v = node.numbers(key, kJoints);
  return Eigen::Map<const JointVector>(v.data());
}

Plane read_plane(const ConfigNode& node) {
  Plane plane{read_vector(node, "normal"), node.number("offset_m")};
  const double length = plane.normal.norm();
  if (!(length > 1e-6)) node.fail("normal", "found length 0, expected a direction");
  // A normal that is already of length one to the last digits is kept as it is: it reads back exactly.
  if (std::abs(length - 1) > 1e-14) plane.normal /= length;
  return plane;
}

CameraModel read_camera_model(const ConfigNode& node) {
  CameraModel c;
  c.width = node.integer("width_px", {1, 100000});
  c.height = node.integer("height_px", {1, 100000});
  c.fx = node.number("fx_px", kFocalRange);
  c.fy = node.number("fy_px", kFocalRange);
  c.cx = node.number("cx_px", kPrincipalPointRange);
  c.cy = node.number("cy_px", kPrincipalPointRange);
  c.k1 = node.number_or("k1", 0, kRadialRange);
  c.k2 = node.number_or("k2", 0, kRadialRange);
  c.p1 = node.number_or("p1", 0, kTangentialRange);
  c.p2 = node.number_or("p2", 0, kTangentialRange);
  c.k3 = node.number_or("k3", 0, kRadialRange);
  if (!c.invertible()) node.fail("k1", kFoldsOver);
  return c;
}

ArmModel read_arm_model(const ConfigNode& node) {
  ArmModel arm;
  const std::vector<ConfigNode> links = node.items("dh");
  if (links.size() != arm.dh.size())
    node.fail("dh", "found " + std::to_string(links.size()) + " links, expected " + std::to_string(arm.dh.size()));
  for (std::size_t i = 0; i < links.size(); ++i)
    arm.dh[i] = {links[i].number("a_m", {-10, 10}), links[i].number("alpha_rad", {-7, 7}),
                 links[i].number("d_m", {-10, 10}), links[i].number("theta0_rad", {-7, 7})};
  const ConfigNode limits = node.child("limits_rad"), actuators = node.child("actuators");
  for (int i = 0; i < kJoints; ++i) {
    const std::vector<double> range = limits.numbers(kJointNames[i], 2);
    if (!(range[0] < range[1]))
      limits.fail(kJointNames[i], "found a range that is empty, expected [lower, upper] with lower < upper");
    arm.limits[i] = {range[0], range[1]};
    arm.actuators[i] = read_actuator(actuators.child(kJointNames[i]));
  }
  return arm;
}

}  // namespace tankrig
