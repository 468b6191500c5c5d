#include "calibration/boards/board_target.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"

namespace tankrig {
namespace {

constexpr int kMostCorners = 100;  // along one side
constexpr int kOriginalDictionary = 16;

int dictionary_number(const std::string& name) {
  if (name == "original") return kOriginalDictionary;
  constexpr std::array kSizes{"4x4", "5x5", "6x6", "7x7"};
  constexpr std::array kCounts{"50", "100", "250", "1000"};
  for (std::size_t size = 0; size < kSizes.size(); ++size)
    for (std::size_t count = 0; count < kCounts.size(); ++count)
      if (name == std::string(kSizes[size]) + "_" + kCounts[count])
        return static_cast<int>(size * kCounts.size() + count);
  throw InputError("dictionary: found '" + shown_text(name) +
                   "', expected original, or 4x4, 5x5, 6x6 or 7x7 with _50, _100, _250 or _1000");
}

}  // namespace

std::vector<Vector3d> BoardTarget::points() const {
  std::vector<Vector3d> places;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      places.push_back(kind == TargetKind::kAsymmetricDots
                           ? Vector3d((2 * column + row % 2) * spacing, row * spacing, 0)
                           : Vector3d(column * spacing, row * spacing, 0));
  return places;
}

std::vector<std::vector<int>> BoardTarget::turns() const {
  const auto turned = [this](auto place) {
    std::vector<int> numbers;
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column) numbers.push_back(place(row, column));
    return numbers;
  };
  std::vector<std::vector<int>> all{turned([this](int r, int c) { return r * columns + c; })};
  const bool half = kind == TargetKind::kDots || (kind == TargetKind::kAsymmetricDots && rows % 2 == 0) ||
                    (kind == TargetKind::kCheckerboard && (columns + rows) % 2 == 0);
  const bool quarter =
      columns == rows && (kind == TargetKind::kDots || (kind == TargetKind::kCheckerboard && columns % 2 == 0));
  if (half) all.push_back(turned([this](int r, int c) { return (rows - 1 - r) * columns + columns - 1 - c; }));
  if (quarter) {
    all.push_back(turned([this](int r, int c) { return c * columns + rows - 1 - r; }));
    all.push_back(turned([this](int r, int c) { return (columns - 1 - c) * columns + r; }));
  }
  return all;
}

BoardTarget board_target(TargetKind kind, const std::string& pattern, double spacing, double marker,
                         const std::string& dictionary) {
  BoardTarget target{kind, 0, 0, spacing, marker, 0};
  const std::size_t x = pattern.find('x');
  const bool numbers = x != pattern.npos && parse_number(std::string_view(pattern).substr(0, x), target.columns) &&
                       parse_number(std::string_view(pattern).substr(x + 1), target.rows);
  if (!numbers || std::min(target.columns, target.rows) < 3 || std::max(target.columns, target.rows) > kMostCorners)
    throw InputError(fmt::format(
        "pattern: found '{}', expected COLUMNSxROWS of {} from 3 to {}, such as 9x6", shown_text(pattern),
        kind == TargetKind::kCheckerboard || kind == TargetKind::kCharuco ? "inner corners" : "dots", kMostCorners));
  if (!(spacing >= 1e-4 && spacing <= 2))
    throw InputError(fmt::format("square: found {} mm, expected 0.1 to 2000 mm", 1e3 * spacing));
  if (kind != TargetKind::kCharuco) return target;
  if (target.rows % 2 != 0)
    throw InputError(fmt::format(
        "pattern: found {} rows of corners, so {} rows of squares, expected an odd number of rows of "
        "squares: with an even one the markers' places depend on the version of OpenCV that printed the board",
        target.rows, target.rows + 1));
  if (!(marker > 0 && marker < spacing))
    throw InputError(fmt::format("marker: found {} mm, expected more than 0 and less than a square's {} mm",
                                 1e3 * marker, 1e3 * spacing));
  target.dictionary = dictionary_number(dictionary);
  return target;
}

}  // namespace tankrig
