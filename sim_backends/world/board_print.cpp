#include "sim_backends/world/board_print.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/aruco.hpp>
#include <utility>

#include "core/input_error.hpp"

namespace tankrig::sim {
namespace {

constexpr float kBlack = 0.03f, kWhite = 0.4f;  // matt and grey: no camera of the tank clips it in its own light

const std::pair<const char*, int> kDictionaries[] = {
    {"4x4_50", cv::aruco::DICT_4X4_50},
    {"4x4_100", cv::aruco::DICT_4X4_100},
    {"4x4_250", cv::aruco::DICT_4X4_250},
    {"5x5_50", cv::aruco::DICT_5X5_50},
    {"5x5_100", cv::aruco::DICT_5X5_100},
    {"5x5_250", cv::aruco::DICT_5X5_250},
    {"6x6_50", cv::aruco::DICT_6X6_50},
    {"6x6_250", cv::aruco::DICT_6X6_250},
    {"apriltag_16h5", cv::aruco::DICT_APRILTAG_16h5},
    {"apriltag_25h9", cv::aruco::DICT_APRILTAG_25h9},
    {"apriltag_36h11", cv::aruco::DICT_APRILTAG_36h11},
};

bool has_markers(const BoardPattern& p) { return p.kind == BoardKind::kCharuco || p.kind == BoardKind::kMarkers; }

/// White squares before square (column, row) in reading order.
int white_before(const BoardPattern& p, int column, int row) {
  const int whole = row / 2 * p.columns + (row % 2) * (p.columns / 2);  // an even row has columns / 2 of them
  return whole + (row % 2 ? (column + 1) / 2 : column / 2);
}

}  // namespace

std::vector<std::string> board_dictionaries() {
  std::vector<std::string> names;
  for (const auto& [name, number] : kDictionaries) names.emplace_back(name);
  return names;
}

BoardPrint::BoardPrint(const BoardPattern& pattern) : pattern_(pattern) {
  from_ = static_cast<float>(-pattern.margin);
  to_x_ = static_cast<float>(to().x());
  to_y_ = static_cast<float>(to().y());
  if (!has_markers(pattern)) return;
  const auto named = std::find_if(std::begin(kDictionaries), std::end(kDictionaries),
                                  [&](const auto& d) { return pattern.dictionary == d.first; });
  if (named == std::end(kDictionaries))
    throw InputError("board: found dictionary '" + pattern.dictionary +
                     "', expected one of: " + fmt::format("{}", fmt::join(board_dictionaries(), ", ")));
  const auto dictionary = cv::aruco::getPredefinedDictionary(named->second);
  modules_ = dictionary->markerSize + 2;
  const int count =
      pattern.kind == BoardKind::kMarkers ? pattern.columns * pattern.rows : white_before(pattern, 0, pattern.rows);
  if (pattern.first_id + count > dictionary->bytesList.rows)
    throw InputError(fmt::format("board: found {} markers from {} on, expected at most the {} of {}", count,
                                 pattern.first_id, dictionary->bytesList.rows, pattern.dictionary));
  for (int i = 0; i < count; ++i) {
    cv::Mat drawn;
    dictionary->drawMarker(pattern.first_id + i, modules_, drawn, 1);
    markers_.emplace_back(drawn.begin<uchar>(), drawn.end<uchar>());
  }
}

Vector2d BoardPrint::size() const {
  return Vector2d(pattern_.columns, pattern_.rows) * pattern_.pitch + Vector2d::Constant(2 * pattern_.margin);
}

bool BoardPrint::covers(float x, float y) const { return x >= from_ && y >= from_ && x <= to_x_ && y <= to_y_; }

float BoardPrint::albedo(float x, float y) const { return black(x, y) ? kBlack : kWhite; }

bool BoardPrint::marker_black(int number, float x, float y) const {
  const auto side = static_cast<float>(pattern_.marker);
  if (x < 0 || y < 0 || x >= side || y >= side) return false;
  const float module = side / static_cast<float>(modules_);
  const int u = std::min(modules_ - 1, static_cast<int>(x / module)),
            v = std::min(modules_ - 1, static_cast<int>(y / module));
  return markers_[number][v * modules_ + u] == 0;
}

bool BoardPrint::black(float x, float y) const {
  const auto pitch = static_cast<float>(pattern_.pitch);
  if (x < 0 || y < 0 || x >= pitch * static_cast<float>(pattern_.columns) ||
      y >= pitch * static_cast<float>(pattern_.rows))
    return false;
  const int column = std::min(pattern_.columns - 1, static_cast<int>(x / pitch)),
            row = std::min(pattern_.rows - 1, static_cast<int>(y / pitch));
  const float in_x = x - pitch * static_cast<float>(column), in_y = y - pitch * static_cast<float>(row);
  const float gap = 0.5f * (pitch - static_cast<float>(pattern_.marker));
  switch (pattern_.kind) {
    case BoardKind::kCheckerboard:
      return (column + row) % 2 == 0;
    case BoardKind::kCharuco:
      return (column + row) % 2 == 0 || marker_black(white_before(pattern_, column, row), in_x - gap, in_y - gap);
    case BoardKind::kMarkers:
      return marker_black(row * pattern_.columns + column, in_x - gap, in_y - gap);
    case BoardKind::kDots: {
      const float dx = in_x - pitch / 2, dy = in_y - pitch / 2, radius = static_cast<float>(pattern_.marker) / 2;
      return dx * dx + dy * dy < radius * radius;
    }
  }
  return false;
}

}  // namespace tankrig::sim
