// Draws the differences between a rig and its drawings.
#include "sim_backends/world/true_rig.hpp"

#include <cmath>
#include <numbers>

#include "sim_backends/world/hash_noise.hpp"
#include "sim_backends/world/scene.hpp"

namespace tankrig::sim {
namespace {

constexpr ConfigRange kShare{0, 0.2};

const Setting<TrueRig> kTrueRigRows[] = {
    {"seed", &TrueRig::seed, "of all that follows; `--truth-seed` overrides it"},
    {"camera_moved_mm", &TrueRig::camera_moved, ConfigRange(0, 200), "every camera; right with left"},
    {"camera_turned_deg", &TrueRig::camera_turned, ConfigRange(0, 20), "likewise"},
    {"eye_moved_mm", &TrueRig::eye_moved, ConfigRange(0, 50), "the right camera besides, against the left"},
    {"eye_turned_deg", &TrueRig::eye_turned, ConfigRange(0, 10), "likewise"},
    {"focal_share", &TrueRig::focal, kShare, "of every camera's focal lengths"},
    {"centre_px", &TrueRig::centre, ConfigRange(0, 100), "of every principal point, in x and in y"},
    {"k1", &TrueRig::k1, ConfigRange(0, 1), "added to every camera's"},
    {"k2", &TrueRig::k2, ConfigRange(0, 1), "likewise"},
    {"p1", &TrueRig::p1, ConfigRange(0, 0.1), "likewise"},
    {"p2", &TrueRig::p2, ConfigRange(0, 0.1), "likewise"},
    {"port_distance_mm", &TrueRig::port_distance, ConfigRange(0, 50), "added to that of every port"},
    {"port_turned_deg", &TrueRig::port_turned, ConfigRange(0, 10), "every port's normal"},
    {"joint_zero_deg", &TrueRig::joint_zero, ConfigRange(0, 10), "of slew, shoulder, elbow and jaw rotation"},
    {"laser_moved_mm", &TrueRig::laser_moved, ConfigRange(0, 50), "the projector on the end effector"},
    {"laser_turned_deg", &TrueRig::laser_turned, ConfigRange(0, 10), "likewise"},
    {"object_moved_mm", &TrueRig::object_moved, ConfigRange(0, 200), "the object, on the floor"},
    {"object_turned_deg", &TrueRig::object_turned, ConfigRange(0, 45), "likewise, about the vertical"},
    {"latency_ms", &TrueRig::latency, ConfigRange(-1000, 1000), "added to the stamp of every frame"},
};

/// Random numbers of one thing, by its name.
class Draw {
 public:
  Draw(std::uint64_t seed, std::string_view thing) : key_(mix(mix(seed, hash_text("true rig")), hash_text(thing))) {}

  double within(double bound) { return bound * (2 * next() - 1); }
  Vector3d direction() {
    const double z = 2 * next() - 1, angle = 2 * std::numbers::pi * next(), r = std::sqrt(1 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
  }
  double about(double size) { return size * (0.75 + 0.5 * next()); }
  Transform move(double moved, double turned) {
    Transform t = Transform::Identity();
    const Vector3d way = about(moved) * direction();
    const double angle = about(turned);
    t.linear() = Eigen::AngleAxisd(angle, direction()).toRotationMatrix();
    t.translation() = way;
    return t;
  }

 private:
  double next() { return unit(mix(key_, ++count_)); }
  std::uint64_t key_, count_ = 0;
};

}  // namespace

constinit const SettingsTable<TrueRig> kTrueRigKeys{kTrueRigRows};

Scene as_built(Scene scene, const TrueRig& truth) {
  Transform left = Transform::Identity();
  for (CameraSpec& camera : scene.cameras) {
    Draw draw(truth.seed, "camera " + camera.name);
    // Both eyes of a stereo pair stand on one bar.
    const Transform before = camera.wMc;
    if (camera.name == "right")
      camera.wMc = left * before * draw.move(truth.eye_moved, truth.eye_turned);
    else
      camera.wMc = before * draw.move(truth.camera_moved, truth.camera_turned);
    if (camera.name == "left") left = camera.wMc * before.inverse();
    CameraModel& m = camera.model;
    const double focal = 1 + draw.within(truth.focal);
    m.fx *= focal, m.fy *= focal;
    m.cx += draw.within(truth.centre), m.cy += draw.within(truth.centre);
    m.k1 += draw.within(truth.k1), m.k2 += draw.within(truth.k2);
    m.p1 += draw.within(truth.p1), m.p2 += draw.within(truth.p2);
    if (!m.port) continue;
    m.port->distance = std::max(0.0, m.port->distance + draw.within(truth.port_distance));
    m.port->normal = draw.move(0, truth.port_turned).linear() * m.port->normal;
  }
  Draw zeros(truth.seed, "joint zeros");
  for (DhLink& link : scene.arm.model.dh) link.theta0 -= zeros.within(truth.joint_zero);
  scene.laser.eMl = scene.laser.eMl * Draw(truth.seed, "laser").move(truth.laser_moved, truth.laser_turned);
  for (SceneObject& object : scene.objects) {
    if (!object.target) continue;
    Draw draw(truth.seed, "object");
    const double angle = 2 * std::numbers::pi * draw.about(1), way = draw.about(truth.object_moved);
    object.wMo = Eigen::Translation3d(way * std::cos(angle), way * std::sin(angle), 0) * object.wMo *
                 Eigen::AngleAxisd(draw.within(truth.object_turned), Vector3d::UnitZ());
  }
  return scene;
}

}  // namespace tankrig::sim
