#include "bench/benchmark/function.hpp"

#include <muParser.h>

#include <cmath>

namespace tankrig {
namespace {

const char* const kNameCharacters = "0123456789_.abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
constexpr std::size_t kLongest = 4096;  // muParser's own limit is 5000

struct Detail {
  const char *name, *unit;
};

std::vector<Detail> details(MeasureKind kind, Arithmetic arithmetic) {
  switch (kind) {
    case MeasureKind::kTime:
      return {{"time", "s"}};
    case MeasureKind::kCollision:
      return {{"score", "1"}, {"contacts", "1"}, {"clearance", "m"}};
    case MeasureKind::kPositionError:
      return {{"total", "m"}, {"x", "m"}, {"y", "m"}, {"z", "m"}, {"rx", "1"}, {"ry", "1"}, {"rz", "1"}, {"rw", "1"}};
    case MeasureKind::kDistance:
      return {{"distance", "m"}};
    case MeasureKind::kEuclideanNorm:
      return {{"norm", "1"}};
    case MeasureKind::kObjectCenteredOnCam:
      return {{"total", "px"}, {"x", "px"}, {"y", "px"}};
    case MeasureKind::kReconstruction3D:
      if (arithmetic == Arithmetic::kUwsim)
        return {{"mean_error", "m"}, {"error_variance", "m2"}, {"coverage", "1"}, {"outliers", "1"}};
      return {{"mean_error", "m"}, {"stddev", "m"}, {"coverage", "1"}, {"outliers", "1"}, {"of_ceiling", "1"}};
    case MeasureKind::kPathFollowing:
      return {{"ise", "m s"}, {"last_error", "m"}, {"waypoint", "1"}};
    case MeasureKind::kEnergy:
      return {{"energy", "J"}, {"charge", "A s"}};
    case MeasureKind::kSyncResidual:
      return {{"p99", "s"}, {"max", "s"}, {"on_target_max", "m"}};
    case MeasureKind::kSweepVelocityError:
      return {{"rms", "rad/s"}, {"max", "rad/s"}};
    case MeasureKind::kFramesLost:
      return {{"lost", "1"}, {"recorded", "1"}};
  }
  return {};
}

template <class Part>
const std::vector<std::string>& list_of(MeasureKind kind, Arithmetic arithmetic, Part part) {
  static const auto table = [&] {
    std::map<std::pair<MeasureKind, Arithmetic>, std::vector<std::string>> lists;
    for (std::size_t i = 0; i < kNames<MeasureKind>.size(); ++i)
      for (const Arithmetic a : {Arithmetic::kPaper, Arithmetic::kUwsim})
        for (const Detail& detail : details(static_cast<MeasureKind>(i), a))
          lists[{static_cast<MeasureKind>(i), a}].push_back(part(detail));
    return lists;
  }();
  return table.at({kind, arithmetic});
}

/// The names an expression uses, with a value each.
mu::Parser parser_of(const std::string& expression) {
  mu::Parser parser;
  parser.DefineNameChars(kNameCharacters);
  parser.SetExpr(expression);
  return parser;
}

}  // namespace

const std::vector<std::string>& details_of(MeasureKind kind, Arithmetic arithmetic) {
  return list_of(kind, arithmetic, [](const Detail& detail) { return detail.name; });
}

const std::vector<std::string>& units_of(MeasureKind kind, Arithmetic arithmetic) {
  return list_of(kind, arithmetic, [](const Detail& detail) { return detail.unit; });
}

std::string function_error(const std::string& expression, const std::vector<Measure>& measures) {
  if (expression.size() > kLongest) return "expected at most " + std::to_string(kLongest) + " characters";
  double one = 1;
  std::string known;
  try {
    mu::Parser parser = parser_of(expression);
    for (const Measure& measure : measures) {
      parser.DefineVar(measure.name, &one);
      known += (known.empty() ? "" : ", ") + measure.name;
      for (const std::string& detail : details_of(measure.kind, measure.arithmetic))
        parser.DefineVar(measure.name + "." + detail, &one);
    }
    (void)parser.Eval();
  } catch (const mu::Parser::exception_type& e) {
    std::string what = e.GetMsg();
    for (char& c : what)
      if (static_cast<unsigned char>(c) < 0x20) c = ' ';
    return "expected an expression over the measures " + known + " and their details (" + what + ")";
  }
  return {};
}

std::optional<double> function_value(const std::string& expression, const DetailValues& values) {
  try {
    mu::Parser parser = parser_of(expression);
    DetailValues used = values;
    for (auto& [name, value] : used) parser.DefineVar(name, &value);
    const double result = parser.Eval();
    if (!std::isfinite(result)) return std::nullopt;
    return result;
  } catch (const mu::Parser::exception_type&) {
    return std::nullopt;  // read_benchmark() has checked it: something it names is absent
  }
}

}  // namespace tankrig
