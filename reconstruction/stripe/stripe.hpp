// The laser stripe in an image: its points, and why the others were left out.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/enum_names.hpp"

namespace tankrig {

/// Which way the stripe lies in the image.
enum class StripeOrientation : std::uint8_t {
  kAuto,     ///< found from the image (of several frames in StripeReconstruction)
  kColumns,  ///< it crosses the columns: one point per column, searched along the column (the paper's)
  kRows,     ///< it crosses the rows: one point per row
};
template <>
inline constexpr std::array kNames<StripeOrientation>{"auto", "columns", "rows"};

const char* to_string(StripeOrientation orientation);

/// One point of the stripe.
/// Units: pixels, centre of the top-left pixel at 0.
struct StripePeak {
  float column = 0;     ///< along the stripe: the image column, or the row for kRows
  float position = 0;   ///< across it, sub-pixel: the image row, or the column for kRows
  float sigma_px = 0;   ///< one standard deviation of `position`
  float intensity = 0;  ///< brightest channel at the peak [0, 1] of full scale
};

/// What became of every column (row, for kRows), and afterwards of every triangulated point.
/// columns = peaks + no_peak + low_snr + ambiguous + too_wide + skewed + edge + isolated;
/// peaks = points + behind_camera + grazing + outside_workspace + particle.
struct StripeStatistics {
  std::uint64_t frames = 0;
  std::uint64_t hazy_frames = 0;    ///< of them, whose stripe is moved back from haze on one side
  std::uint64_t columns = 0;        ///< columns searched
  std::uint64_t no_peak = 0;        ///< nothing above the noise
  std::uint64_t low_snr = 0;        ///< something, but too weak, or not in line with its neighbours
  std::uint64_t ambiguous = 0;      ///< a second line almost as strong: a reflection
  std::uint64_t too_wide = 0;       ///< wider than the stripe can be
  std::uint64_t skewed = 0;         ///< lopsided: light of two surfaces mixed
  std::uint64_t edge = 0;           ///< beside a jump of the stripe and belonging to neither side
  std::uint64_t isolated = 0;       ///< a run of too few columns: a floating particle
  std::uint64_t peaks = 0;          ///< stripe points found in images
  std::uint64_t behind_camera = 0;  ///< ray meets the laser plane behind the camera, or nowhere
  std::uint64_t grazing = 0;        ///< ray too nearly parallel to the laser plane
  std::uint64_t outside_workspace = 0;
  std::uint64_t particle = 0;  ///< alone in space
  std::uint64_t points = 0;    ///< points of the cloud

  StripeStatistics& operator+=(const StripeStatistics& other);
};

/// Name and value of each count, in the order above: for reports.
std::vector<std::pair<std::string, std::uint64_t>> counts(const StripeStatistics& statistics);

struct StripeDetection {
  StripeOrientation orientation = StripeOrientation::kColumns;  ///< never kAuto
  std::vector<StripePeak> peaks;                                ///< in order of `column`
  StripeStatistics statistics;                                  ///< of one frame
};

/// Per-pixel median of images of one size and type; for an even count the mean of the middle two, rounded.
/// Errors: InputError if there is none, or sizes or types differ.
cv::Mat median_background(const std::vector<cv::Mat>& images);

}  // namespace tankrig
