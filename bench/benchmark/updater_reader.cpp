// From <sceneUpdater> to the loops of the product.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "bench/benchmark/benchmark_element.hpp"
#include "core/arm_model.hpp"
#include "core/shown_text.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kMostNested = 8;
constexpr double kMostSteps = 100'000;
constexpr Bounds kPeriod{1e-6, 1e6}, kAngle{-10, 10}, kTolerance{0.001, 1}, kDistance{0, 1e3};

/// What each updater has; a '?' marks what may be absent.
const std::map<UpdaterKind, std::vector<const char*>>& children_of_updaters() {
  static const std::map<UpdaterKind, std::vector<const char*>> table{
      {UpdaterKind::kNone, {}},
      {UpdaterKind::kFog, {"initialValue", "finalValue", "step", "interval"}},
      {UpdaterKind::kBagFog,
       {"initialValue", "finalValue", "step", "interval", "bag", "imageTopic", "infoTopic", "imageDepth", "imagePub",
        "infoPub"}},
      {UpdaterKind::kCurrent,
       {"initialValue", "finalValue", "step", "interval", "sphericalDirection", "forceVariation", "forcePeriod",
        "directionVariation", "directionPeriod", "random", "target"}},
      {UpdaterKind::kArmMove, {"step", "interval", "target"}},
      {UpdaterKind::kRepeat, {"iterations", "interval"}},
      {UpdaterKind::kLight, {"initialValue", "finalValue", "step", "interval"}},
      {UpdaterKind::kNoise, {"initialValue", "finalValue", "step", "interval"}},
      {UpdaterKind::kParticles, {"initialValue", "finalValue", "step", "interval"}},
      {UpdaterKind::kSweepSpeed, {"initialValue", "finalValue", "step", "interval"}},
      {UpdaterKind::kAlgorithm, {"interval"}},
      {UpdaterKind::kCalibrationError, {"initialValue", "finalValue", "step", "interval", "target", "error"}},
      {UpdaterKind::kLux, {"initialValue", "finalValue", "step", "tolerance", "interval"}},
  };
  return table;
}

/// What the rig can take of each kind.
Bounds bounds_of(UpdaterKind kind) {
  switch (kind) {
    case UpdaterKind::kLight:
      return {0, 1};
    case UpdaterKind::kNoise:
      return {0, 0.1};
    case UpdaterKind::kParticles:
      return {0, 1e5};
    case UpdaterKind::kSweepSpeed:
      return {0.01, 1};
    case UpdaterKind::kCalibrationError:
      return {-0.5, 0.5};
    case UpdaterKind::kLux:
      return {0, 1e6};
    default:
      return kNotNegative;
  }
}

/// The bound itself, or what older files call it.
XmlElement bound(const XmlElement& element, const char* name, const char* older) {
  const auto found = element.optional(name);
  const auto other = element.optional(older);
  if (found && other) other->fail("found <" + other->name() + "> beside <" + name + ">, expected one of them");
  if (!other) return element.child(name);
  other->warn("<" + other->name() + "> is an older name: <" + name + ">");
  return *other;
}

void read_bounds(const XmlElement& element, Updater& updater) {
  const std::string column = updater.column(), older_first = "initial" + column, older_last = "final" + column;
  const Bounds bounds = bounds_of(updater.kind);
  const XmlElement first = bound(element, "initialValue", older_first.c_str());
  const XmlElement last = bound(element, "finalValue", older_last.c_str());
  updater.first = benchmark_number(first, bounds);
  updater.last = benchmark_number(last);
  if (!(updater.last >= updater.first))
    last.fail(fmt::format("<{}>: found {:g}, expected at least the first value, {:g}", last.name(), updater.last,
                          updater.first));
  updater.step = benchmark_number(element, "step", kPeriod);
  if ((updater.last - updater.first) / updater.step > kMostSteps)
    element.child("step").fail(fmt::format("<step>: found more than {:.0f} steps, expected fewer", kMostSteps));
  if (const double highest = updater.value(updater.count() - 1); highest > bounds.upper)
    last.fail(
        fmt::format("<{}>: found a last value of {:g}, expected at most {:g}", last.name(), highest, bounds.upper));
}

void read_angles(const XmlElement& element, const char* name, double& theta, double& phi, Bounds bounds) {
  const XmlElement child = element.child(name);
  child.expect({"theta", "phi"});
  theta = benchmark_number(child, "theta", bounds);
  phi = benchmark_number(child, "phi", bounds);
}

void read_current(const XmlElement& element, Updater& updater) {
  CurrentSwing& swing = updater.current;
  read_angles(element, "sphericalDirection", swing.theta, swing.phi, kAngle);
  read_angles(element, "directionVariation", swing.theta_variation, swing.phi_variation, kAngle);
  read_angles(element, "directionPeriod", swing.theta_period, swing.phi_period, kPeriod);
  swing.force_variation = benchmark_number(element, "forceVariation", kNotNegative);
  swing.force_period = benchmark_number(element, "forcePeriod", kPeriod);
  swing.random = benchmark_number(element, "random", kNotNegative);
  swing.as_force = element.attribute_choice("publishAsForce", {"false", "true"}) == "true";
}

/// Errors: InputError if a level stands there twice, or beside bounds.
void read_levels(const XmlElement& element, Updater& updater) {
  for (const XmlElement& level : element.children("level")) {
    const double lux = benchmark_number(level, bounds_of(UpdaterKind::kLux));
    if (std::ranges::find(updater.levels, lux) != updater.levels.end())
      level.fail(fmt::format("<level>: found {:g} for the second time, expected each level once", lux));
    updater.levels.push_back(lux);
  }
  for (const char* name : {"initialValue", "finalValue", "step"})
    if (const auto found = element.optional(name))
      found->fail("found <" + found->name() + "> beside <level>, expected levels, or first, last and step");
}

/// From the first posture to the last in steps of the way, 0 to their number less one.
void read_arm_positions(const XmlElement& element, Updater& updater) {
  for (const XmlElement& position : element.children("armPosition")) {
    position.expect({}, {"joint"});
    std::vector<double> joints;
    for (const XmlElement& joint : position.children("joint")) joints.push_back(benchmark_number(joint, kAngle));
    if (joints.size() != kJoints)
      position.fail(fmt::format("<armPosition>: found {} <joint>, expected {}", joints.size(), kJoints));
    updater.arm_positions.push_back(joints);
  }
  if (updater.arm_positions.empty()) element.fail("<armMoveUpdater>: found no <armPosition>, expected at least one");
  updater.last = static_cast<double>(updater.arm_positions.size() - 1);
  updater.step = benchmark_number(element, "step", {1e-4, 1e6});
}

void read_pose_error(const XmlElement& element, Updater& updater) {
  (void)element.child("target");
  constexpr std::string_view kErrors[] = {"x", "y", "z", "aboutX", "aboutY", "aboutZ"};
  const std::string error = element.text("error");
  const auto found = std::ranges::find(kErrors, error);
  if (found == std::end(kErrors))
    element.child("error").fail("<error>: found '" + shown_text(error) +
                                "', expected x, y, z, aboutX, aboutY or aboutZ");
  const auto place = static_cast<int>(found - kErrors);
  updater.error = {place % 3, place > 2};
}

}  // namespace

void read_updaters(const XmlElement& element, std::vector<Updater>& updaters) {
  if (updaters.size() == kMostNested)
    element.fail(fmt::format("found <sceneUpdater> nested {} deep, expected at most {}", kMostNested + 1, kMostNested));
  element.expect({kNames<UpdaterKind>.begin(), kNames<UpdaterKind>.end()});
  const std::vector<XmlElement> inside = element.children();
  if (inside.size() != 1) element.fail(fmt::format("<sceneUpdater>: found {} elements, expected one", inside.size()));
  const XmlElement& loop = inside.front();
  Updater updater;
  updater.kind = benchmark_choice<UpdaterKind>(loop, loop.name());
  updater.line = loop.line();

  XmlElement::Names known = children_of_updaters().at(updater.kind), repeated, attributes;
  const std::string older_first = "initial" + std::string(updater.column());
  const std::string older_last = "final" + std::string(updater.column());
  const bool has_bounds = !known.empty() && known.front() == std::string_view("initialValue");
  if (has_bounds) known.insert(known.end(), {older_first.c_str(), older_last.c_str()});
  if (updater.kind != UpdaterKind::kNone) known.push_back("sceneUpdater");
  if (updater.kind == UpdaterKind::kArmMove) repeated = {"armPosition"};
  if (updater.kind == UpdaterKind::kAlgorithm) repeated = {"cloud"};
  if (updater.kind == UpdaterKind::kLux) repeated = {"level"};
  if (updater.kind == UpdaterKind::kCurrent) attributes = {"publishAsForce"};
  loop.expect(known, repeated, {}, attributes);
  if (updater.kind == UpdaterKind::kNone) return;

  updater.interval_s = benchmark_number(loop, "interval", kNotNegative);
  const bool has_levels = updater.kind == UpdaterKind::kLux && loop.has("level");
  if (has_levels) read_levels(loop, updater);
  if (has_bounds && !has_levels) read_bounds(loop, updater);
  if (updater.kind == UpdaterKind::kLux && loop.has("tolerance"))
    updater.tolerance = benchmark_number(loop, "tolerance", kTolerance);
  if (loop.has("target")) updater.target = loop.text("target");
  if (updater.kind == UpdaterKind::kCurrent) (void)loop.child("target"), read_current(loop, updater);
  if (updater.kind == UpdaterKind::kArmMove) (void)loop.child("target"), read_arm_positions(loop, updater);
  if (updater.kind == UpdaterKind::kCalibrationError) read_pose_error(loop, updater);
  if (updater.kind == UpdaterKind::kRepeat) updater.last = loop.integer("iterations", {1, kMostSteps}) - 1;
  if (updater.kind == UpdaterKind::kAlgorithm) {
    for (const XmlElement& cloud : loop.children("cloud")) updater.clouds.push_back(cloud.text());
    if (updater.clouds.empty()) loop.fail("<algorithmUpdater>: found no <cloud>, expected at least one");
    updater.last = static_cast<double>(updater.clouds.size() - 1);
  }
  if (updater.kind == UpdaterKind::kBagFog) {
    updater.bag = loop.text("bag");
    updater.image_topic = loop.text("imageTopic");
    updater.info_topic = loop.text("infoTopic");
    updater.image_depth_m = benchmark_number(loop, "imageDepth", kDistance);
  }
  updaters.push_back(updater);
  if (loop.has("sceneUpdater")) read_updaters(loop.child("sceneUpdater"), updaters);
}

}  // namespace tankrig
