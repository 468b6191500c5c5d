#include "apps/tankrig/results/coverage_option.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "core/csv.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"

namespace tankrig::app {
namespace {

// Below: finer than the patches of the surface, so probably metres. Above: longer than any object of a tank.
constexpr double kLeast = 0.1, kMost = 1000;  // [mm]

}  // namespace

std::vector<double> parse_coverage(const std::string& millimetres) {
  std::vector<double> thresholds;
  for (const std::string& text : split_csv_line(millimetres)) {
    double mm = 0;
    if (!parse_number(text, mm) || !(mm >= kLeast && mm <= kMost))
      throw InputError(
          fmt::format("found '{}', expected millimetres from {} to {} with commas between them, as 1,2,5,10",
                      shown_text(text), kLeast, kMost));
    const double metres = mm / 1000;
    if (std::find(thresholds.begin(), thresholds.end(), metres) != thresholds.end())
      throw InputError(fmt::format("found '{}' for the second time, expected it once", shown_text(text)));
    thresholds.push_back(metres);
  }
  return thresholds;
}

void add_coverage_option(CLI::App* command, std::string& millimetres) {
  const auto refused = [](const std::string& text) -> std::string {
    try {
      parse_coverage(text);
      return {};
    } catch (const InputError& e) {
      return e.what();
    }
  };
  command
      ->add_option("--coverage", millimetres,
                   "Thresholds of coverage [mm], as 1,2,5,10 (default: the rig file's, else 2,5,10)")
      ->check(CLI::Validator(refused, ""));
}

void set_coverage(MetricThresholds& thresholds, const std::string& millimetres) {
  if (!millimetres.empty()) thresholds.coverage_m = parse_coverage(millimetres);
}

}  // namespace tankrig::app
