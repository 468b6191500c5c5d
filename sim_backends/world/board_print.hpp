// What is printed on a calibration board: squares, markers or dots, sharp at any distance.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/enum_names.hpp"
#include "core/frames.hpp"

namespace tankrig::sim {

/// A charuco board has its markers in the white squares, the first square is black; as OpenCV 4.6 draws it.
enum class BoardKind { kCheckerboard, kCharuco, kMarkers, kDots };

}  // namespace tankrig::sim

namespace tankrig {
template <>
inline constexpr std::array kNames<sim::BoardKind>{"checkerboard", "charuco", "markers", "dots"};
}  // namespace tankrig

namespace tankrig::sim {

/// Units: metres.
struct BoardPattern {
  BoardKind kind = BoardKind::kCheckerboard;
  int columns = 9, rows = 7;          ///< squares, markers or dots
  double pitch = 0.04;                ///< side of a square; from marker to marker, from dot to dot
  double marker = 0.03;               ///< side of a marker with its black frame; diameter of a dot
  double margin = 0.02;               ///< white around all of them
  std::string dictionary = "4x4_50";  ///< of the markers: one of OpenCV's, in lower case
  int first_id = 0;
};

/// Frames: the board's own. Origin at the outer corner of the first square (marker, dot's cell), x along the first row,
/// y down the columns, z into the board: what is printed is seen from -z.
/// Threads: const calls from any.
class BoardPrint {
 public:
  /// Errors: InputError if the dictionary is not known, or has fewer markers than the board.
  explicit BoardPrint(const BoardPattern& pattern);

  const BoardPattern& pattern() const { return pattern_; }
  Vector2d from() const { return Vector2d::Constant(-pattern_.margin); }
  Vector2d to() const { return from() + size(); }
  Vector2d size() const;
  bool covers(float x, float y) const;
  /// Of the print at (x, y); grey, the same in all channels.
  float albedo(float x, float y) const;

 private:
  bool black(float x, float y) const;
  bool marker_black(int number, float x, float y) const;

  BoardPattern pattern_;
  float from_, to_x_, to_y_;
  int modules_ = 0;                                 ///< along a marker's side, its frame included
  std::vector<std::vector<std::uint8_t>> markers_;  ///< row by row, 0 is black
};

/// OpenCV's names of its dictionaries as board files have them.
std::vector<std::string> board_dictionaries();

}  // namespace tankrig::sim
