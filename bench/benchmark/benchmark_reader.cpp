// From a benchmark file to its measures, triggers and functions.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "bench/benchmark/benchmark_element.hpp"
#include "bench/benchmark/function.hpp"
#include "core/input_error.hpp"
#include "core/regular_file.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"

namespace tankrig {
namespace {

constexpr std::uint64_t kMostBytes = 1U << 20;  // published files have two thousand
constexpr std::size_t kMostMeasures = 256, kMostPoints = 1'000'000;
constexpr Bounds kMetres{-1e3, 1e3}, kSeconds{1e-3, 1e6};

Trigger read_trigger(const XmlElement& element) {
  element.expect({"type", "target", "position", "value"});
  Trigger trigger;
  trigger.line = element.line();
  const XmlElement type = element.child("type");
  trigger.kind = benchmark_choice<TriggerKind>(type, shown_text(type.text()));
  if (element.has("target")) trigger.target = element.text("target");
  const auto need = [&](const char* child, const char* what) {
    if (!element.has(child))
      element.fail("<" + element.name() + ">: found no <" + child + ">, expected " + what + " of a trigger '" +
                   name_of(trigger.kind) + "'");
  };
  switch (trigger.kind) {
    case TriggerKind::kPosition:
      need("position", "the place");
      trigger.position = benchmark_position(element.child("position"));
      [[fallthrough]];
    case TriggerKind::kTopic:
    case TriggerKind::kService:
    case TriggerKind::kOnMove:
    case TriggerKind::kOnNoMove:
    case TriggerKind::kScanPhase:
      need("target", "the target");
      break;
    case TriggerKind::kJointAngle:
      need("target", "the joint");
      need("value", "the angle [rad]");
      trigger.value = benchmark_number(element, "value", {-10, 10});
      break;
    case TriggerKind::kLuxLevel:
      need("value", "the level [lx]");
      trigger.value = benchmark_number(element, "value", kNotNegative);
      break;
    case TriggerKind::kOnInit:
    case TriggerKind::kNever:
      break;
  }
  return trigger;
}

GroundTruth read_truth(const XmlElement& element) {
  const std::optional<std::string> type = element.attribute("type");
  if (!type) element.fail("<groundTruth>: found no attribute 'type', expected one");
  GroundTruth truth;
  truth.kind = benchmark_choice<GroundTruthKind>(element, shown_text(*type));
  switch (truth.kind) {
    case GroundTruthKind::kConstant:
      element.expect({}, {"value"}, {}, {"type"});
      for (const XmlElement& value : element.children("value")) truth.values.push_back(benchmark_number(value));
      if (truth.values.empty()) element.fail("<groundTruth>: found no <value>, expected at least one");
      break;
    case GroundTruthKind::kCornersFromCamera:
    case GroundTruthKind::kCentroidFromCamera:
      element.expect({"camera", "target", "publishOn"}, {}, {}, {"type"});
      truth.camera = element.text("camera");
      truth.target = element.text("target");
      if (element.has("publishOn")) truth.publish_on = element.text("publishOn");
      break;
    case GroundTruthKind::kRelativeLocation:
      element.expect({"from", "to"}, {}, {}, {"type"});
      truth.from = element.text("from");
      truth.to = element.text("to");
      break;
  }
  return truth;
}

/// What each measure has beside name, log, startOn and stopOn; a '?' marks what may be absent.
const std::map<MeasureKind, std::vector<std::string>>& children_of_measures() {
  static const std::map<MeasureKind, std::vector<std::string>> table{
      {MeasureKind::kTime, {}},
      {MeasureKind::kCollision, {"target"}},
      {MeasureKind::kPositionError, {"target", "position", "topic?"}},
      {MeasureKind::kDistance, {"target"}},
      {MeasureKind::kEuclideanNorm, {"groundTruth", "target"}},
      {MeasureKind::kObjectCenteredOnCam, {"target", "camera"}},
      {MeasureKind::kReconstruction3D, {"target", "topic", "from", "levelOfDetail?"}},
      {MeasureKind::kPathFollowing, {"target", "topic?", "from?"}},
      {MeasureKind::kEnergy, {}},
      {MeasureKind::kSyncResidual, {}},
      {MeasureKind::kSweepVelocityError, {}},
      {MeasureKind::kFramesLost, {}},
  };
  return table;
}

Arithmetic read_arithmetic(const XmlElement& element, Arithmetic by_default) {
  if (!element.attribute("arithmetic")) return by_default;
  const bool paper = element.attribute_choice("arithmetic", {"paper", "uwsim"}) == "paper";
  return paper ? Arithmetic::kPaper : Arithmetic::kUwsim;
}

Measure read_measure(const XmlElement& element, MeasureKind kind, Arithmetic by_default) {
  std::vector<std::string> names;
  XmlElement::Names known{"name", "log", "startOn", "stopOn"};
  for (const std::string& child : children_of_measures().at(kind)) names.push_back(child.substr(0, child.find('?')));
  for (const std::string& child : names) known.push_back(child.c_str());
  XmlElement::Names attributes;
  if (kind == MeasureKind::kReconstruction3D) attributes = {"detailedResultsToGlobals", "arithmetic"};
  element.expect(known, {}, {}, attributes);

  Measure measure;
  measure.kind = kind;
  measure.line = element.line();
  const XmlElement name = element.child("name");
  measure.name = name.text();
  if (!is_benchmark_name(measure.name))
    name.fail("<name>: found '" + shown_text(measure.name) +
              "', expected at most 64 letters, digits and '_', a letter first: functions use it");
  for (const std::string& child : children_of_measures().at(kind))
    if (!child.ends_with('?')) (void)element.child(child.c_str());
  if (element.has("target")) measure.target = element.text("target");
  if (element.has("topic")) measure.topic = element.text("topic");
  if (element.has("from")) measure.from = element.text("from");
  if (element.has("camera")) measure.camera = element.text("camera");
  if (element.has("position")) measure.position = benchmark_position(element.child("position"));
  if (element.has("groundTruth")) measure.truth = read_truth(element.child("groundTruth"));
  if (element.has("levelOfDetail")) measure.level_of_detail = benchmark_number(element, "levelOfDetail", {1e-4, 1});
  if (element.has("log")) measure.log_s = benchmark_number(element, "log", kSeconds);
  measure.detailed_to_globals = element.attribute_choice("detailedResultsToGlobals", {"false", "true"}) == "true";
  measure.arithmetic = read_arithmetic(element, by_default);
  measure.start = read_trigger(element.child("startOn"));
  measure.stop = read_trigger(element.child("stopOn"));
  return measure;
}

std::vector<Measure> read_measures(const XmlElement& element, Arithmetic by_default) {
  element.expect({}, {kNames<MeasureKind>.begin(), kNames<MeasureKind>.end()});
  std::vector<Measure> measures;
  std::set<std::string> names;
  for (const XmlElement& child : element.children()) {
    if (measures.size() == kMostMeasures)
      child.fail(fmt::format("found more than {} measures, expected no more", kMostMeasures));
    measures.push_back(read_measure(child, benchmark_choice<MeasureKind>(child, child.name()), by_default));
    if (!names.insert(measures.back().name).second)
      child.fail("<name>: found '" + measures.back().name + "' again, expected a name of its own for each measure");
  }
  if (measures.empty()) element.fail("<measures>: found none, expected at least one");
  return measures;
}

Function read_function(const XmlElement& element, const std::vector<Measure>& measures) {
  Function function;
  function.line = element.line();
  function.expression = element.text({"publishResult", "publishRate", "name"});
  function.name = element.attribute("name").value_or("TOTAL");
  if (function.name.empty() || !is_benchmark_name(function.name))
    element.fail("<function>: name: found '" + shown_text(function.name) + "', expected letters, digits and '_'");
  function.publish = element.attribute_choice("publishResult", {"false", "true"}) == "true";
  if (const auto rate = element.attribute("publishRate")) {
    if (!parse_number(*rate, function.publish_rate_s) || !(function.publish_rate_s > 0))
      element.fail("<function>: publishRate: found '" + shown_text(*rate) + "', expected a number of seconds above 0");
  }
  if (const std::string wrong = function_error(function.expression, measures); !wrong.empty())
    element.fail("<function>: found '" + shown_text(function.expression) + "', " + wrong);
  return function;
}

}  // namespace

bool is_benchmark_name(const std::string& name) {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  return name.size() <= 64 && letter(name.front()) &&
         std::all_of(name.begin(), name.end(), [&](char c) { return letter(c) || (c >= '0' && c <= '9'); });
}

double benchmark_number(const XmlElement& element, Bounds bounds) {
  const std::string text = element.text();
  const std::pair<const char*, double> constants[] = {
      {"M_PI", std::numbers::pi}, {"M_PI_2", std::numbers::pi / 2}, {"M_PI_4", std::numbers::pi / 4}};
  for (const auto& [name, value] : constants)
    for (const double sign : {1.0, -1.0}) {
      if (text != (sign < 0 ? "-" : "") + std::string(name)) continue;
      if (!(sign * value >= bounds.lower && sign * value <= bounds.upper))
        element.fail(fmt::format("<{}>: found {}, expected a number in [{:g}, {:g}]", element.name(), text,
                                 bounds.lower, bounds.upper));
      return sign * value;
    }
  return element.number(bounds);
}

double benchmark_number(const XmlElement& parent, const char* child, Bounds bounds) {
  return benchmark_number(parent.child(child), bounds);
}

Vector3d benchmark_position(const XmlElement& element) {
  element.expect({"x", "y", "z"});
  return {benchmark_number(element, "x", kMetres), benchmark_number(element, "y", kMetres),
          benchmark_number(element, "z", kMetres)};
}

Benchmark read_benchmark(const std::filesystem::path& file) {
  const XmlElement root = XmlElement::load(file, "benchmark", {"benchmark", kMostBytes, true});
  root.expect({"algorithms", "measures", "startOn", "stopOn", "sceneUpdater"}, {"function"}, {}, {"arithmetic"});
  Benchmark benchmark;
  benchmark.file = file;
  benchmark.arithmetic = read_arithmetic(root, Arithmetic::kPaper);
  if (root.has("algorithms")) benchmark.algorithms = read_algorithms(root.child("algorithms"));
  benchmark.measures = read_measures(root.child("measures"), benchmark.arithmetic);
  benchmark.start = read_trigger(root.child("startOn"));
  benchmark.stop = read_trigger(root.child("stopOn"));
  std::set<std::string> names;
  for (const Measure& measure : benchmark.measures) names.insert(measure.name);
  for (const XmlElement& child : root.children("function")) {
    benchmark.functions.push_back(read_function(child, benchmark.measures));
    if (!names.insert(benchmark.functions.back().name).second)
      child.fail("<function>: name: found '" + benchmark.functions.back().name + "' again, expected a name of its own");
  }
  if (benchmark.functions.empty()) root.fail("<benchmark>: found no <function>, expected at least one");
  const XmlElement updater = root.child("sceneUpdater");
  read_updaters(updater, benchmark.updaters);
  double points = 1;
  for (const Updater& u : benchmark.updaters) points *= static_cast<double>(u.count());
  if (points > static_cast<double>(kMostPoints))
    updater.fail(fmt::format("<sceneUpdater>: found {:.0f} configurations, expected at most {}", points, kMostPoints));
  benchmark.warnings = root.warnings();
  return benchmark;
}

}  // namespace tankrig
