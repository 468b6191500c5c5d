// A flat calibration target: a checkerboard, a ChArUco board, or a grid of dots.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/enum_names.hpp"
#include "core/frames.hpp"

namespace tankrig {

enum class TargetKind : std::uint8_t { kCheckerboard, kCharuco, kDots, kAsymmetricDots };
template <>
inline constexpr std::array kNames<TargetKind>{"checkerboard", "charuco", "dots", "asymmetric-dots"};

/// Frames: target t: origin at the first corner or dot, x along its row, y down the rows, z into the board.
/// Units: metres.
struct BoardTarget {
  TargetKind kind = TargetKind::kCheckerboard;
  int columns = 0, rows = 0;  ///< inner corners of squares, or dots
  double spacing = 0;         ///< side of a square; from dot to dot; from row to row where the dots are asymmetric
  double marker = 0;          ///< ChArUco: side of a marker
  int dictionary = 0;         ///< ChArUco: cv::aruco's number of it

  std::size_t size() const { return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows); }
  /// Place of every corner or dot, row by row.
  std::vector<Vector3d> points() const;
  /// Where a corner's number goes when the target is turned onto itself, for every turn that looks the same; the first
  /// is no turn. A checkerboard with an odd and an even side has no other.
  std::vector<std::vector<int>> turns() const;
};

/// `pattern` is COLUMNSxROWS. `dictionary` is 4x4_50 and the like, or `original`.
/// Errors: InputError: a pattern that cannot be a board of this kind, a marker that does not fit its square, an unknown
/// dictionary.
BoardTarget board_target(TargetKind kind, const std::string& pattern, double spacing, double marker = 0,
                         const std::string& dictionary = "4x4_50");

}  // namespace tankrig
