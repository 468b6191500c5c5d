#include "calibration/boards/corner_table.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <limits>
#include <map>

#include "core/csv.hpp"
#include "core/input_error.hpp"
#include "core/text_files.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kFewestInPicture = 6;
constexpr int kLargestSide = 100'000;  // px

enum Column : std::size_t { kPicture, kWidth, kHeight, kCorner, kX, kY };

int whole(const CsvTable& table, const CsvRow& row, std::size_t column, int least, int most) {
  int value = 0;
  if (!parse_number(row.fields[column], value) || value < least || value > most)
    table.fail(row, column, fmt::format("a whole number from {} to {}", least, most));
  return value;
}

double pixels(const CsvTable& table, const CsvRow& row, std::size_t column, int side) {
  double value = 0;
  if (!parse_number(row.fields[column], value) || !(value >= -0.5 && value < side - 0.5))
    table.fail(row, column, fmt::format("a place in the picture, from -0.5 to {}.5", side - 1));
  return value;
}

/// Twice the area of the squares whose four corners are there, negative where they go round the other way [px^2].
double area_of(const std::map<int, Vector2d>& corners, const BoardTarget& target) {
  double area = 0;
  for (const auto& [id, at] : corners) {
    const auto beside = corners.find(id + 1), below = corners.find(id + target.columns);
    if (id % target.columns == target.columns - 1 || beside == corners.end() || below == corners.end()) continue;
    const Vector2d a = beside->second - at, b = below->second - at;
    area += a.x() * b.y() - a.y() * b.x();
  }
  return area;
}

BoardSearch board_of(const std::map<int, Vector2d>& corners, const BoardTarget& target) {
  if (corners.size() < kFewestInPicture)
    return {{}, fmt::format("found {} corners, expected {} at least", corners.size(), kFewestInPicture)};
  if (area_of(corners, target) < 0)
    return {{}, "found corners that go round the other way, expected a picture, and numbers, that are not mirrored"};
  FoundBoard board;
  board.smallest_spacing = std::numeric_limits<double>::infinity();
  for (const auto& [id, at] : corners) {
    if (!board.ids.empty())
      board.smallest_spacing = std::min(board.smallest_spacing, (at - board.pixels.back()).norm());
    board.ids.push_back(id), board.pixels.push_back(at);
  }
  return {board, ""};
}

}  // namespace

CornerTable read_corner_table(const std::filesystem::path& file, const BoardTarget& target) {
  const CsvTable table = read_csv(file, {"picture", "width_px", "height_px", "corner", "x_px", "y_px"});
  CornerTable out;
  std::vector<std::map<int, Vector2d>> corners;
  std::map<std::string, std::size_t> places;
  for (const CsvRow& row : table.rows) {
    const cv::Size size(whole(table, row, kWidth, 1, kLargestSide), whole(table, row, kHeight, 1, kLargestSide));
    if (corners.empty()) out.size = size;
    if (size != out.size)
      table.fail(row, size.width != out.size.width ? kWidth : kHeight,
                 fmt::format("{} x {} as in the first line: pictures of one camera", out.size.width, out.size.height));
    const std::string& name = row.fields[kPicture];
    if (name.empty()) table.fail(row, kPicture, "a picture's name");
    const auto [place, added] = places.try_emplace(name, corners.size());
    if (added) corners.emplace_back(), out.pictures.push_back({name, {}});
    const int id = whole(table, row, kCorner, 0, static_cast<int>(target.size()) - 1);
    const Vector2d at(pixels(table, row, kX, size.width), pixels(table, row, kY, size.height));
    if (!corners[place->second].emplace(id, at).second) table.fail(row, kCorner, "each corner of a picture once");
  }
  if (table.cut_short) throw InputError(file, "ends within a line, expected a whole table");
  for (std::size_t i = 0; i < corners.size(); ++i) out.pictures[i].search = board_of(corners[i], target);
  return out;
}

}  // namespace tankrig
