// Loops over rows of images, written to be vectorised.
#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace tankrig {

/// Where b + g + r of a row's pixel is more than `best` of its column, that and `y` are kept.
void keep_brighter(const std::uint8_t* bgr, int columns, int y, std::int16_t* best, std::int16_t* row);

/// out[x] = of the bytes at x of `count` rows the one of that rank, the least being of rank 0.
void select_bytes(const std::uint8_t* const* rows, int count, int rank, int columns, std::uint8_t* out);

/// Whether a byte of the row is at least `limit`.
bool reaches(const std::uint8_t* bytes, int count, std::uint8_t limit);

/// How many values are less than `limit`.
int count_below(const int* values, int count, int limit);

/// out[i] = sum over k from -radius to radius of kernel[|k|] * values[i + k], in this order.
void weigh_line(const float* values, const float* kernel, int radius, int count, float* out);

/// The columns whose value is at least the column's `least`, no less than the one above and more than the one below, into
/// `at`, which holds as many as there are columns; how many they are.
int find_peaks(const float* above, const float* here, const float* below, const float* least, int columns, int* at);

/// Some rows of an image, from `first` on; null: none. `step`: bytes from each to the next.
struct PixelRows {
  const std::uint8_t* first = nullptr;
  std::ptrdiff_t step = 0;
};

/// out[x] = sum of weights[c] * (channel c of pixel x of so many rows, at most 128, less that of `dark` where there is
/// one). 1 or 3 channels.
void weigh_pixels(const PixelRows& in, const PixelRows& dark, int rows, int columns, int channels, const float* weights,
                  float* out);

/// out[x] = kernel[0] * rows[0][x] + sum over k up to `radius` of kernel[k] * (rows[-k][x] + rows[k][x]), in this order.
void weigh_rows(const float* const* rows, const float* kernel, int radius, int columns, float* out);

/// out[x] = sum over k up to `radius` of kernel[k] * (rows[-k][x] - rows[k][x]), in this order.
void weigh_differences(const float* const* rows, const float* kernel, int radius, int columns, float* out);

/// values[x] = the least of it and share * (values[x] - |differences[x]|).
void weaken(const float* differences, float share, int columns, float* values);

/// values[x] = 0 where brightness[x] is not positive.
void keep_lit(const float* brightness, int columns, float* values);

/// The pixels of those columns of every `row_step`-th row, side by side; a rest of fewer rows is left out. 8 bits, 1 or 3
/// channels; empty of an empty image.
cv::Mat sampled_columns(const cv::Mat& image, const std::vector<int>& columns, int row_step = 1);

/// Where values[x] is more than most[x], it and `y` are kept.
void keep_larger(const float* values, int columns, int y, float* most, int* row);

/// Adds 1 where values[x] is more than limits[x] and `y` more than `apart` from rows[x].
void count_rivals(const float* values, const float* limits, const int* rows, int y, int apart, int columns,
                  int* rivals);

/// The row's bytes, less those of `dark` where there is one.
void set_row(const std::uint8_t* in, const std::uint8_t* dark, int count, std::int16_t* values);

/// Likewise: adds them.
void add_row(const std::uint8_t* in, const std::uint8_t* dark, int count, std::int16_t* sums);

/// The channels of each pixel's values, one after the other. 1 or 3 channels.
void split_channels(const std::int16_t* in, int columns, int channels, std::int16_t* out);

/// Likewise: 1 where a byte is at least `limit`, else 0.
void mark_channels(const std::uint8_t* in, std::uint8_t limit, int columns, int channels, std::int16_t* out);

/// out[g] += share * the sum of the g-th `size` values, which 16 bits hold.
void add_groups(const std::int16_t* values, int groups, int size, float share, float* out);

}  // namespace tankrig
