#include "core/model_yaml.hpp"

#include <cmath>

#include "core/camera_ranges.hpp"
#include "core/plausible_length.hpp"
#include "core/settings_table.hpp"

namespace tankrig {
namespace {

constexpr ConfigRange kAngle{-7, 7}, kLength{-10, 10}, kSide{1e-12, 10}, kPixels{1, 100'000};

constexpr double kShortestNormal = 1e-6, kUnitLength = 1e-14;

/// A direction of length one. One that has it to the last digits is kept as it is: it reads back exactly.
void normalise(const ConfigNode& node, Vector3d& normal) {
  const double length = normal.norm();
  if (!(length > kShortestNormal)) node.fail("normal", "found length 0, expected a direction");
  if (std::abs(length - 1) > kUnitLength) normal /= length;
}

const Setting<FlatPort> kPortRows[] = {
    {"distance_m",
     &FlatPort::distance,
     {0, 1},
     "flat port ([calibration.md](calibration.md#behind-a-flat-port)): of its inner face from the lens's viewpoint",
     Need::kRequired},
    {"thickness_m", &FlatPort::thickness, {0, 0.2}, "of its pane", Need::kRequired},
    {"normal", &FlatPort::normal, {-1, 1}, "across it, towards the water, in c"},
    {"index_air", &FlatPort::air, {1, 1.1}, "refractive index inside"},
    {"index_glass", &FlatPort::glass, {1.2, 2.5}, "of the pane: 1.49 is acrylic, 1.52 window glass"},
    {"index_water", &FlatPort::water, {1.2, 1.5}, "of the water: 1.333 is fresh, 1.34 the sea"},
};
constexpr SettingsTable<FlatPort> kPort{kPortRows};

void read_port(const ConfigNode& node, const char* key, CameraModel& camera) {
  const ConfigNode port = node.child(key);
  read_settings(port, kPort, camera.port.emplace());
  normalise(port, camera.port->normal);
}
void write_port(YAML::Emitter& out, const CameraModel& camera) { write_mapping(out, kPort, *camera.port, YAML::Flow); }

const Setting<CameraModel> kCamera[] = {
    {"width_px", &CameraModel::width, kPixels, "of the picture", Need::kRequired},
    {"height_px", &CameraModel::height, kPixels, "of the picture", Need::kRequired},
    {"fx_px", &CameraModel::fx, kFocalRange, "focal length along x", Need::kRequired},
    {"fy_px", &CameraModel::fy, kFocalRange, "focal length along y", Need::kRequired},
    {"cx_px", &CameraModel::cx, kPrincipalPointRange, "principal point; the top-left pixel's centre is (0, 0)",
     Need::kRequired},
    {"cy_px", &CameraModel::cy, kPrincipalPointRange, "principal point", Need::kRequired},
    {"k1", &CameraModel::k1, kRadialRange, "radial distortion, Brown-Conrady in OpenCV's order"},
    {"k2", &CameraModel::k2, kRadialRange, "radial distortion"},
    {"p1", &CameraModel::p1, kTangentialRange, "tangential distortion"},
    {"p2", &CameraModel::p2, kTangentialRange, "tangential distortion"},
    {"k3", &CameraModel::k3, kRadialRange, "radial distortion"},
    {"port",
     {read_port, write_port, "", [](const std::string& place) { return settings_rows(place, kPort); },
      [](const CameraModel& camera) { return camera.port.has_value(); }}},
};

void check_camera(const ConfigNode& node, const CameraModel& camera) {
  if (!camera.invertible()) node.fail("k1", kFoldsOver);
  if (!camera.looks_through_port())
    node.fail("port", "found pixels that do not look through it, expected a normal along the view, towards the water");
}

const Setting<DhLink> kLinkRows[] = {
    {"a_m", &DhLink::a, kLength, "Denavit-Hartenberg (standard): Rz(q + theta0) Tz(d) Tx(a) Rx(alpha); four links",
     Need::kRequired},
    {"alpha_rad", &DhLink::alpha, kAngle, "likewise", Need::kRequired},
    {"d_m", &DhLink::d, kLength, "likewise", Need::kRequired},
    {"theta0_rad", &DhLink::theta0, kAngle, "likewise", Need::kRequired},
};
constexpr SettingsTable<DhLink> kLink{kLinkRows};

const Setting<Actuator> kLinearRows[] = {
    {"d_m", &Actuator::d, kSide, "linear actuator: fixed side of its triangle ([arm5e.md](arm5e.md))", Need::kRequired},
    {"r_m", &Actuator::r, kSide, "the other fixed side", Need::kRequired},
    {"l_min_m", &Actuator::l_min, kSide, "the actuator's length at tick 0", Need::kRequired},
    {"m_per_tick", &Actuator::m_per_tick, {1e-12, 1}, "its growth", Need::kRequired},
    {"alpha0_rad", &Actuator::alpha0, kAngle, "the triangle's angle at q0_rad", Need::kRequired},
    {"q0_rad", &Actuator::q0, kAngle, "joint angle at alpha0_rad", Need::kRequired},
    {"sign", &Actuator::sign, ConfigRange(-1, 1), "1, or -1 where the joint's angle falls as the actuator grows",
     Need::kRequired},
};
void check_linear(const ConfigNode& node, const Actuator& actuator) {
  if (actuator.sign == 0) node.fail("sign", "found '0', expected 1 or -1");
}
constexpr SettingsTable<Actuator> kLinear{kLinearRows, check_linear};

const Setting<Actuator> kRotaryRows[] = {
    {"rad_per_tick", &Actuator::rad_per_tick, "rotary actuator: instead of all of these", Need::kRequired},
};
void check_rotary(const ConfigNode& node, const Actuator& actuator) {
  if (actuator.rad_per_tick == 0) node.fail("rad_per_tick", "found 0, expected another number");
}
constexpr SettingsTable<Actuator> kRotary{kRotaryRows, check_rotary};

void read_links(const ConfigNode& node, const char* key, ArmModel& arm) {
  const std::vector<ConfigNode> links = node.items(key);
  if (links.size() != arm.dh.size())
    node.fail(key, "found " + std::to_string(links.size()) + " links, expected " + std::to_string(arm.dh.size()));
  for (std::size_t i = 0; i < links.size(); ++i) read_settings(links[i], kLink, arm.dh[i]);
}
void write_links(YAML::Emitter& out, const ArmModel& arm) {
  out << YAML::BeginSeq;
  for (const DhLink& link : arm.dh) write_mapping(out, kLink, link, YAML::Flow);
  out << YAML::EndSeq;
}

void read_limits(const ConfigNode& node, const char* key, ArmModel& arm) {
  const ConfigNode limits = node.child(key);
  for (std::size_t j = 0; j < kJoints; ++j) {
    const std::vector<double> range = limits.numbers(kJointNames[j], 2);
    if (!(range[0] < range[1]))
      limits.fail(kJointNames[j], "found a range that is empty, expected [lower, upper] with lower < upper");
    arm.limits[j] = {range[0], range[1]};
  }
}
void write_limits(YAML::Emitter& out, const ArmModel& arm) {
  out << YAML::BeginMap;
  for (std::size_t j = 0; j < kJoints; ++j) {
    out << YAML::Key << kJointNames[j] << YAML::Value;
    emit_list(out, std::array{arm.limits[j].lower, arm.limits[j].upper});
  }
  out << YAML::EndMap;
}

void read_actuators(const ConfigNode& node, const char* key, ArmModel& arm) {
  const ConfigNode actuators = node.child(key);
  for (std::size_t j = 0; j < kJoints; ++j) {
    const ConfigNode actuator = actuators.child(kJointNames[j]);
    arm.actuators[j] = {};
    read_settings(actuator, actuator.has("rad_per_tick") ? kRotary : kLinear, arm.actuators[j]);
  }
}
void write_actuators(YAML::Emitter& out, const ArmModel& arm) {
  out << YAML::BeginMap;
  for (std::size_t j = 0; j < kJoints; ++j) {
    out << YAML::Key << kJointNames[j] << YAML::Value;
    write_mapping(out, arm.actuators[j].d == 0 ? kRotary : kLinear, arm.actuators[j], YAML::Flow);
  }
  out << YAML::EndMap;
}

const Setting<ArmModel> kArm[] = {
    {"dh",
     {read_links, write_links, "", [](const std::string& place) { return settings_rows(place + "[]", kLink); }},
     "",
     Need::kRequired},
    {"limits_rad", {read_limits, write_limits, "[lower, upper] by joint name"}, "the joints' angles", Need::kRequired},
    {"actuators",
     {read_actuators, write_actuators, "",
      [](const std::string& place) {
        return settings_rows(place + ".JOINT", kLinear) + settings_rows(place + ".JOINT", kRotary);
      }},
     "",
     Need::kRequired},
};

}  // namespace

constinit const SettingsTable<CameraModel> kCameraModelKeys{kCamera, check_camera};
constinit const SettingsTable<ArmModel> kArmModelKeys{kArm};

void emit(YAML::Emitter& out, const Transform& aMb) {
  out << YAML::Flow << YAML::BeginMap << YAML::Key << "translation_m" << YAML::Value;
  emit_list(out, Vector3d(aMb.translation()));
  out << YAML::Key << "quaternion_xyzw" << YAML::Value;
  emit_list(out, quaternion_xyzw(aMb));
  out << YAML::EndMap;
}

void emit(YAML::Emitter& out, const Plane& plane) {
  out << YAML::Flow << YAML::BeginMap << YAML::Key << "normal" << YAML::Value;
  emit_list(out, plane.normal);
  out << YAML::Key << "offset_m" << YAML::Value << exact_text(plane.offset) << YAML::EndMap;
}

void emit(YAML::Emitter& out, const CameraModel& camera) { write_mapping(out, kCameraModelKeys, camera, YAML::Flow); }

void emit(YAML::Emitter& out, const ArmModel& arm) { write_mapping(out, kArmModelKeys, arm); }

Vector3d read_vector(const ConfigNode& node, std::string_view key) {
  const std::vector<double> v = node.numbers(key, 3);
  return {v[0], v[1], v[2]};
}

Plane read_plane(const ConfigNode& node) {
  Plane plane{read_vector(node, "normal"), node.number("offset_m")};
  normalise(node, plane.normal);
  return plane;
}

void check_laser_reach(const ConfigNode& node, std::string_view origin_key, const Plane& ePl,
                       const Vector3d& origin_e) {
  if (std::abs(ePl.offset) > kLongestReach)
    node.fail("ePl", "found offset_m " + exact_text(ePl.offset) + kLaserOutOfReach);
  if (origin_e.norm() > kLongestReach)
    node.fail(origin_key, "found a point " + exact_text(origin_e.norm()) + " m off" + kLaserOutOfReach);
}

}  // namespace tankrig
