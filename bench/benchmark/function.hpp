// A benchmark's global results: expressions over its measures, computed by muParser.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bench/benchmark/benchmark.hpp"

namespace tankrig {

/// What the details of a measure are called in results and, as MEASURE.DETAIL, in functions. MEASURE alone is the first.
const std::vector<std::string>& details_of(MeasureKind kind, Arithmetic arithmetic = Arithmetic::kPaper);

/// Unit of each detail, in their order: "m", "s", "1" for a share or a count.
const std::vector<std::string>& units_of(MeasureKind kind, Arithmetic arithmetic = Arithmetic::kPaper);

/// What is wrong with the expression: "expected ...". Empty: nothing.
std::string function_error(const std::string& expression, const std::vector<Measure>& measures);

/// By name: MEASURE and MEASURE.DETAIL. What is absent has no value.
using DetailValues = std::map<std::string, double>;

/// The expression's value; none if something it names has none, or it is not finite.
std::optional<double> function_value(const std::string& expression, const DetailValues& values);

}  // namespace tankrig
