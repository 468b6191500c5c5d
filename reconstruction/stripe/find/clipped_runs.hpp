// Where a stripe across the columns is brighter than the camera can tell.
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <vector>

namespace tankrig {

/// From here up a value is clipped.
inline constexpr int kFullScale = 254;

/// From here up a value may be that of a clipped run's end.
inline constexpr int kKnee = 240;

/// Rows of one column in which a channel is clipped.
struct ClippedRun {
  int first = 0, last = -1;
  int width() const { return last - first + 1; }
};

/// The clipped runs of an image's columns. A run begins at full scale and goes on down to 15/16 of it: compression and a
/// sensor's knee round a plateau.
class ClippedRuns {
 public:
  /// Of the channels with a positive weight. `image`: 8-bit, 1 or 3 channels.
  ClippedRuns(const cv::Mat& image, const std::array<float, 3>& weights);

  /// From top to bottom.
  const std::vector<ClippedRun>& of(int column) const { return runs_[static_cast<std::size_t>(column)]; }

  /// The widest of a column within `reach` of a row; empty if there is none.
  ClippedRun at(int column, double row, double reach) const;

 private:
  std::vector<std::vector<ClippedRun>> runs_;
};

}  // namespace tankrig
