#include "reconstruction/stripe/find/image_rows.hpp"

#include <algorithm>
#include <cstring>
#include <type_traits>
#include <vector>

#include "reconstruction/stripe/vectorised.hpp"

namespace tankrig {
namespace {

constexpr int kLanes = 8;

inline __attribute__((always_inline)) EightFloats load(const float* values) {
  EightFloats loaded;
  std::memcpy(&loaded, values, sizeof loaded);
  return loaded;
}

}  // namespace

TANKRIG_VECTORISED
void keep_brighter(const std::uint8_t* __restrict bgr, int columns, int y, std::int16_t* __restrict best,
                   std::int16_t* __restrict row) {
  const auto here = static_cast<std::int16_t>(y);
  for (int x = 0; x < columns; ++x) {
    const auto sum = static_cast<std::int16_t>(bgr[3 * x] + bgr[3 * x + 1] + bgr[3 * x + 2]);
    const bool brighter = sum > best[x];
    best[x] = brighter ? sum : best[x];
    row[x] = brighter ? here : row[x];
  }
}

/// Bit by bit from the highest: a bit is set where no more than `rank` bytes are below the value with it.
TANKRIG_VECTORISED
void select_bytes(const std::uint8_t* const* rows, int count, int rank, int columns, std::uint8_t* out) {
  constexpr int kBlock = 64;
  std::uint8_t found[kBlock], tried[kBlock], values[kBlock] = {};
  std::int16_t below[kBlock];
  const auto select = [&](int begin, auto length) {
    for (int i = 0; i < kBlock; ++i) found[i] = 0;
    for (int bit = 128; bit > 0; bit /= 2) {
      for (int i = 0; i < kBlock; ++i) tried[i] = static_cast<std::uint8_t>(found[i] | bit), below[i] = 0;
      for (int row = 0; row < count; ++row) {
        std::memcpy(values, rows[row] + begin, length);
        for (int i = 0; i < kBlock; ++i) below[i] = static_cast<std::int16_t>(below[i] + (values[i] < tried[i]));
      }
      for (int i = 0; i < kBlock; ++i) found[i] = below[i] <= rank ? tried[i] : found[i];
    }
    std::memcpy(out + begin, found, length);
  };
  if (columns < kBlock) return select(0, static_cast<std::size_t>(columns));
  for (int next = 0; next < columns; next += kBlock)  // the last block overlaps the one before
    select(std::min(next, columns - kBlock), std::integral_constant<std::size_t, kBlock>{});
}

TANKRIG_VECTORISED
bool reaches(const std::uint8_t* bytes, int count, std::uint8_t limit) {
  std::uint8_t most = 0;
  for (int i = 0; i < count; ++i) most = bytes[i] > most ? bytes[i] : most;
  return most >= limit;
}

TANKRIG_VECTORISED
int count_below(const int* values, int count, int limit) {
  constexpr int kTogether = 4, kBlock = kTogether * kLanes;
  EightInts below[kTogether] = {}, here;
  int i = 0;
  for (; i + kBlock <= count; i += kBlock)
    for (int k = 0; k < kTogether; ++k) {
      std::memcpy(&here, values + i + k * kLanes, sizeof here);
      below[k] -= here < limit;
    }
  const EightInts sum = (below[0] + below[1]) + (below[2] + below[3]);
  int all = 0;
  for (int k = 0; k < kLanes; ++k) all += sum[k];
  for (; i < count; ++i) all += values[i] < limit;
  return all;
}

namespace {

TANKRIG_VECTORISED
void add_bytes(const std::uint8_t* __restrict in, int count, std::int16_t* __restrict sums) {
  for (int i = 0; i < count; ++i) sums[i] = static_cast<std::int16_t>(sums[i] + in[i]);
}

TANKRIG_VECTORISED
void add_differences(const std::uint8_t* __restrict in, const std::uint8_t* __restrict dark, int count,
                     std::int16_t* __restrict sums) {
  for (int i = 0; i < count; ++i) sums[i] = static_cast<std::int16_t>(sums[i] + in[i] - dark[i]);
}

TANKRIG_VECTORISED
void widen(const std::uint8_t* __restrict in, int count, std::int16_t* __restrict out) {
  for (int i = 0; i < count; ++i) out[i] = in[i];
}

TANKRIG_VECTORISED
void subtract(const std::uint8_t* __restrict in, const std::uint8_t* __restrict dark, int count,
              std::int16_t* __restrict out) {
  for (int i = 0; i < count; ++i) out[i] = static_cast<std::int16_t>(in[i] - dark[i]);
}

TANKRIG_VECTORISED
void split_colour(const std::int16_t* __restrict in, int columns, std::int16_t* __restrict first,
                  std::int16_t* __restrict second, std::int16_t* __restrict third) {
  for (int x = 0; x < columns; ++x) {
    first[x] = in[3 * x];
    second[x] = in[3 * x + 1];
    third[x] = in[3 * x + 2];
  }
}

TANKRIG_VECTORISED
void weigh_planes(const std::int16_t* __restrict first, const std::int16_t* __restrict second,
                  const std::int16_t* __restrict third, int columns, float w0, float w1, float w2,
                  float* __restrict out) {
  for (int x = 0; x < columns; ++x) out[x] = w0 * first[x] + w1 * second[x] + w2 * third[x];
}

TANKRIG_VECTORISED
void weigh_plane(const std::int16_t* __restrict in, int columns, float weight, float* __restrict out) {
  for (int x = 0; x < columns; ++x) out[x] = weight * in[x];
}

TANKRIG_VECTORISED
void add_pairs(const std::int16_t* __restrict in, int pairs, std::int16_t* __restrict out) {
  for (int i = 0; i < pairs; ++i) out[i] = static_cast<std::int16_t>(in[2 * i] + in[2 * i + 1]);
}

TANKRIG_VECTORISED
void add_triples(const std::int16_t* __restrict in, int triples, std::int16_t* __restrict out) {
  for (int i = 0; i < triples; ++i) out[i] = static_cast<std::int16_t>(in[3 * i] + in[3 * i + 1] + in[3 * i + 2]);
}

void add_each(const std::int16_t* in, int groups, int size, std::int16_t* out) {
  for (int g = 0; g < groups; ++g) {
    int sum = 0;
    for (int i = 0; i < size; ++i) sum += in[g * size + i];
    out[g] = static_cast<std::int16_t>(sum);
  }
}

TANKRIG_VECTORISED
void add_share(const std::int16_t* __restrict sums, int count, float share, float* __restrict out) {
  for (int i = 0; i < count; ++i) out[i] += share * static_cast<float>(sums[i]);
}

}  // namespace

void weigh_pixels(const PixelRows& in, const PixelRows& dark, int rows, int columns, int channels, const float* weights,
                  float* out) {
  constexpr int kBlock = 256;  // pixels whose values stay in the first cache
  std::int16_t light[3 * kBlock], first[kBlock], second[kBlock], third[kBlock];
  for (int x = 0; x < columns; x += kBlock) {
    const int count = std::min(kBlock, columns - x), at = channels * x, values = channels * count;
    const auto row = [&](int y) { return in.first + y * in.step + at; };
    const auto dark_row = [&](int y) { return dark.first ? dark.first + y * dark.step + at : nullptr; };
    set_row(row(0), dark_row(0), values, light);
    for (int y = 1; y < rows; ++y) add_row(row(y), dark_row(y), values, light);
    if (channels == 1) {
      weigh_plane(light, count, weights[0], out + x);
    } else {
      split_colour(light, count, first, second, third);
      weigh_planes(first, second, third, count, weights[0], weights[1], weights[2], out + x);
    }
  }
}

namespace {

/// Of the rows' sums, or where `odd` of their differences.
template <bool odd>
inline __attribute__((always_inline)) void weigh_pairs(const float* const* rows, const float* kernel, int radius,
                                                       int columns, float* __restrict out) {
  constexpr int kTogether = 8, kBlock = kTogether * kLanes;  // values that stay in registers
  for (int next = 0; columns >= kBlock && next < columns; next += kBlock) {
    const int begin = std::min(next, columns - kBlock);  // the last block overlaps the one before
    EightFloats sums[kTogether];
#pragma GCC unroll 8
    for (int i = 0; i < kTogether; ++i) sums[i] = odd ? EightFloats{} : kernel[0] * load(rows[0] + begin + i * kLanes);
    for (int k = 1; k <= radius; ++k) {
      const float *up = rows[-k] + begin, *down = rows[k] + begin;
#pragma GCC unroll 8
      for (int i = 0; i < kTogether; ++i) {
        const EightFloats above = load(up + i * kLanes), below = load(down + i * kLanes);
        sums[i] += kernel[k] * (odd ? above - below : above + below);
      }
    }
#pragma GCC unroll 8
    for (int i = 0; i < kTogether; ++i) std::memcpy(out + begin + i * kLanes, &sums[i], sizeof sums[i]);
  }
  for (int x = 0; columns < kBlock && x < columns; ++x) {
    float sum = odd ? 0 : kernel[0] * rows[0][x];
    for (int k = 1; k <= radius; ++k) sum += kernel[k] * (odd ? rows[-k][x] - rows[k][x] : rows[-k][x] + rows[k][x]);
    out[x] = sum;
  }
}

}  // namespace

TANKRIG_VECTORISED
void weigh_rows(const float* const* rows, const float* kernel, int radius, int columns, float* out) {
  weigh_pairs<false>(rows, kernel, radius, columns, out);
}

TANKRIG_VECTORISED
void weigh_differences(const float* const* rows, const float* kernel, int radius, int columns, float* out) {
  weigh_pairs<true>(rows, kernel, radius, columns, out);
}

TANKRIG_VECTORISED
void weaken(const float* __restrict differences, float share, int columns, float* __restrict values) {
  for (int x = 0; x < columns; ++x) {
    const float size = differences[x] < 0 ? -differences[x] : differences[x], less = share * (values[x] - size);
    values[x] = less < values[x] ? less : values[x];
  }
}

TANKRIG_VECTORISED
void weigh_line(const float* values, const float* kernel, int radius, int count, float* __restrict out) {
  constexpr int kBlock = 4 * kLanes;
  for (int next = 0; count >= kBlock && next < count; next += kBlock) {
    const int begin = std::min(next, count - kBlock);
    EightFloats sums[4] = {}, in;
    for (int k = -radius; k <= radius; ++k)
      for (int i = 0; i < 4; ++i) {
        std::memcpy(&in, values + begin + k + i * kLanes, sizeof in);
        sums[i] += kernel[k < 0 ? -k : k] * in;
      }
    for (int i = 0; i < 4; ++i) std::memcpy(out + begin + i * kLanes, &sums[i], sizeof sums[i]);
  }
  for (int x = 0; count < kBlock && x < count; ++x) {
    float sum = 0;
    for (int k = -radius; k <= radius; ++k) sum += kernel[k < 0 ? -k : k] * values[x + k];
    out[x] = sum;
  }
}

TANKRIG_VECTORISED
void keep_lit(const float* __restrict brightness, int columns, float* __restrict values) {
  for (int x = 0; x < columns; ++x) values[x] = brightness[x] <= 0 ? 0 : values[x];
}

TANKRIG_VECTORISED
void keep_larger(const float* __restrict values, int columns, int y, float* __restrict most, int* __restrict row) {
  for (int x = 0; x < columns; ++x) {
    const bool larger = values[x] > most[x];
    most[x] = larger ? values[x] : most[x];
    row[x] = larger ? y : row[x];
  }
}

TANKRIG_VECTORISED
void count_rivals(const float* __restrict values, const float* __restrict limits, const int* __restrict rows, int y,
                  int apart, int columns, int* __restrict rivals) {
  for (int x = 0; x < columns; ++x) {
    const bool away = (y - rows[x] > apart) | (rows[x] - y > apart);
    rivals[x] += away & (values[x] > limits[x]);
  }
}

cv::Mat sampled_columns(const cv::Mat& image, const std::vector<int>& columns, int row_step) {
  if (image.empty()) return {};
  const auto channels = static_cast<std::size_t>(image.channels());
  std::vector<std::size_t> places;
  for (const int column : columns) places.push_back(static_cast<std::size_t>(column) * channels);
  cv::Mat out(image.rows / row_step, static_cast<int>(columns.size()), image.type());
  // Each pixel with what follows it, as one word, over which the next is written; of the last row nothing follows.
  const auto gather = [&](int y, auto size) {
    const std::uint8_t* in = image.ptr<std::uint8_t>(y * row_step);
    std::uint8_t* next = out.ptr<std::uint8_t>(y);
    for (const std::size_t place : places) {
      std::memcpy(next, in + place, size);
      next += channels;
    }
  };
  using Word = std::integral_constant<int, 4>;
  const bool words = std::min(image.cols, out.cols) >= Word::value;
  for (int y = 0; y + 1 < out.rows; ++y) words ? gather(y, Word{}) : gather(y, channels);
  gather(out.rows - 1, channels);
  return out;
}

TANKRIG_VECTORISED
int find_peaks(const float* above, const float* here, const float* below, const float* least, int columns, int* at) {
  constexpr int kTogether = 4;
  const auto none = [](const EightInts& mask) {
    std::uint64_t parts[4];
    std::memcpy(parts, &mask, sizeof mask);
    return (parts[0] | parts[1] | parts[2] | parts[3]) == 0;
  };
  int found = 0, begin = 0;
  for (; begin + kTogether * kLanes <= columns; begin += kTogether * kLanes) {
    EightInts high[kTogether], any = {};
    for (int i = 0; i < kTogether; ++i)
      any |= high[i] = load(here + begin + i * kLanes) >= load(least + begin + i * kLanes);
    if (none(any)) continue;  // most are
    for (int i = 0; i < kTogether; ++i) {
      const int x = begin + i * kLanes;
      const EightFloats value = load(here + x);
      const EightInts peaks = high[i] & (value >= load(above + x)) & (value > load(below + x));
      if (none(peaks)) continue;
      for (int k = 0; k < kLanes; ++k) at[found] = x + k, found -= peaks[k];
    }
  }
  for (; begin < columns; ++begin)
    if (here[begin] >= least[begin] && here[begin] >= above[begin] && here[begin] > below[begin]) at[found++] = begin;
  return found;
}

void set_row(const std::uint8_t* in, const std::uint8_t* dark, int count, std::int16_t* sums) {
  dark ? subtract(in, dark, count, sums) : widen(in, count, sums);
}

void add_row(const std::uint8_t* in, const std::uint8_t* dark, int count, std::int16_t* sums) {
  dark ? add_differences(in, dark, count, sums) : add_bytes(in, count, sums);
}

void split_channels(const std::int16_t* in, int columns, int channels, std::int16_t* out) {
  if (channels == 1)
    std::copy(in, in + columns, out);
  else
    split_colour(in, columns, out, out + columns, out + 2 * columns);
}

void mark_channels(const std::uint8_t* in, std::uint8_t limit, int columns, int channels, std::int16_t* out) {
  for (int c = 0; c < channels; ++c)
    for (int x = 0; x < columns; ++x) out[c * columns + x] = in[x * channels + c] >= limit;
}

void add_groups(const std::int16_t* values, int groups, int size, float share, float* out) {
  thread_local std::vector<std::int16_t> sums[2];
  int count = groups * size;
  for (bool second = false; size > 1; second = !second) {
    sums[second].resize(static_cast<std::size_t>(count));
    std::int16_t* next = sums[second].data();
    const int together = size % 2 == 0 ? 2 : size % 3 == 0 ? 3 : size;
    size /= together;
    count /= together;
    if (together == 2)
      add_pairs(values, count, next);
    else if (together == 3)
      add_triples(values, count, next);
    else
      add_each(values, count, together, next);
    values = next;
  }
  add_share(values, groups, share, out);
}

}  // namespace tankrig
