// Loops over image rows beside their plain twins: the same bits, for every length.
#include "reconstruction/stripe/find/image_rows.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <utility>
#include <vector>

namespace tankrig {
namespace {

constexpr int kLengths[] = {1, 7, 8, 31, 32, 33, 100, 257};
constexpr unsigned kSeed = 1;

std::vector<std::uint8_t> bytes(std::mt19937& random, int count) {
  std::vector<std::uint8_t> out(static_cast<std::size_t>(count));
  for (std::uint8_t& byte : out) byte = static_cast<std::uint8_t>(random());
  return out;
}

std::vector<float> floats(std::mt19937& random, int count) {
  std::vector<float> out(static_cast<std::size_t>(count));
  for (float& value : out) value = std::uniform_real_distribution<float>(-9, 9)(random);
  return out;
}

TEST(ImageRows, KeepTheFirstOfTheBrightestPixels) {
  std::mt19937 random(kSeed);
  for (const int n : kLengths) {
    std::vector<std::int16_t> best(n, -1), row(n, -1), expected_best(best), expected_row(row);
    for (int y = 0; y < 20; ++y) {
      std::vector<std::uint8_t> in = bytes(random, 3 * n);
      for (std::uint8_t& byte : in) byte &= 0xc0;  // equals
      keep_brighter(in.data(), n, y, best.data(), row.data());
      for (int x = 0; x < n; ++x)
        if (const int sum = in[3 * x] + in[3 * x + 1] + in[3 * x + 2]; sum > expected_best[x])
          expected_best[x] = static_cast<std::int16_t>(sum), expected_row[x] = static_cast<std::int16_t>(y);
    }
    EXPECT_EQ(best, expected_best) << n;
    EXPECT_EQ(row, expected_row) << n;
  }
}

TEST(ImageRows, GiveUpTheByteOfARank) {
  std::mt19937 random(kSeed);
  for (const int n : kLengths)
    for (const int count : {1, 2, 9, 20, 300}) {
      std::vector<std::vector<std::uint8_t>> values;
      std::vector<const std::uint8_t*> rows;
      for (int i = 0; i < count; ++i) values.push_back(bytes(random, n));
      for (const std::vector<std::uint8_t>& row : values) rows.push_back(row.data());
      for (const int rank : {0, count / 2, count - 1}) {
        std::vector<std::uint8_t> out(n), expected(n), at(count);
        select_bytes(rows.data(), count, rank, n, out.data());
        for (int x = 0; x < n; ++x) {
          for (int i = 0; i < count; ++i) at[i] = values[i][x];
          std::sort(at.begin(), at.end());
          expected[x] = at[rank];
        }
        EXPECT_EQ(out, expected) << n << " columns, rank " << rank << " of " << count;
      }
    }
}

TEST(ImageRows, SayWhetherAByteReachesALimit) {
  std::vector<std::uint8_t> row(100, 253);
  EXPECT_FALSE(reaches(row.data(), 100, 254));
  for (int i : {0, 63, 99}) {
    std::vector<std::uint8_t> one = row;
    one[static_cast<std::size_t>(i)] = 254;
    EXPECT_TRUE(reaches(one.data(), 100, 254)) << i;
  }
}

TEST(ImageRows, AreWeighedAcrossThemInOneOrder) {
  std::mt19937 random(kSeed);
  for (const int n : kLengths)
    for (const int radius : {2, 8, 33}) {
      std::vector<std::vector<float>> values;
      std::vector<const float*> rows;
      for (int k = -radius; k <= radius; ++k) values.push_back(floats(random, n));
      for (const std::vector<float>& row : values) rows.push_back(row.data());
      const std::vector<float> kernel = floats(random, radius + 1);
      std::vector<float> out(n), expected(n);
      weigh_rows(rows.data() + radius, kernel.data(), radius, n, out.data());
      for (int x = 0; x < n; ++x) expected[x] = kernel[0] * values[radius][x];
      for (int k = 1; k <= radius; ++k)
        for (int x = 0; x < n; ++x) expected[x] += kernel[k] * (values[radius - k][x] + values[radius + k][x]);
      EXPECT_EQ(out, expected) << n << " columns, radius " << radius;
      weigh_differences(rows.data() + radius, kernel.data(), radius, n, out.data());
      std::ranges::fill(expected, 0.0f);
      for (int k = 1; k <= radius; ++k)
        for (int x = 0; x < n; ++x) expected[x] += kernel[k] * (values[radius - k][x] - values[radius + k][x]);
      EXPECT_EQ(out, expected) << n << " columns, radius " << radius;
    }
}

TEST(ImageRows, AreWeighedAlongThemInOneOrder) {
  std::mt19937 random(kSeed);
  for (const int n : kLengths)
    for (const int radius : {2, 8, 33}) {
      const std::vector<float> values = floats(random, n + 2 * radius), kernel = floats(random, radius + 1);
      std::vector<float> out(n), expected(n, 0.0f);
      weigh_line(values.data() + radius, kernel.data(), radius, n, out.data());
      for (int k = -radius; k <= radius; ++k)
        for (int i = 0; i < n; ++i) expected[i] += kernel[std::abs(k)] * values[radius + i + k];
      EXPECT_EQ(out, expected) << n << " values, radius " << radius;
    }
}

TEST(ImageRows, TellTheColumnsOfTheirPeaks) {
  std::mt19937 random(kSeed);
  for (const int n : kLengths)
    for (int round = 0; round < 20; ++round) {
      std::vector<float> values[3];
      for (std::vector<float>& row : values) row = floats(random, n);
      for (int x = 0; x < n; x += 3)  // equals
        for (std::vector<float>& row : values) row[x] = std::round(row[x]);
      std::vector<float> least = floats(random, n);
      for (float& limit : least) limit = std::round(7 + limit / 4);
      std::vector<int> found(n), expected;
      found.resize(find_peaks(values[0].data(), values[1].data(), values[2].data(), least.data(), n, found.data()));
      for (int x = 0; x < n; ++x)
        if (const float h = values[1][x]; h >= least[x] && h >= values[0][x] && h > values[2][x]) expected.push_back(x);
      EXPECT_EQ(found, expected) << n;
    }
}

TEST(ImageRows, KeepTheFirstOfTheLargestValuesAndCountTheirRivals) {
  std::mt19937 random(kSeed);
  constexpr int kRows = 20, kApart = 3;
  for (const int n : kLengths) {
    std::vector<std::vector<float>> rows;
    for (int y = 0; y < kRows; ++y) {
      rows.push_back(floats(random, n));
      for (float& value : rows.back()) value = std::round(value);  // equals
    }
    std::vector<float> most = rows[0], limits;
    std::vector<int> best(n, 0), rivals(n, 0);
    for (int y = 1; y < kRows; ++y) keep_larger(rows[y].data(), n, y, most.data(), best.data());
    for (const float value : most) limits.push_back(value - 2);
    for (int y = 0; y < kRows; ++y)
      count_rivals(rows[y].data(), limits.data(), best.data(), y, kApart, n, rivals.data());
    for (int x = 0; x < n; ++x) {
      int expected = 0, others = 0;
      for (int y = 1; y < kRows; ++y)
        if (rows[y][x] > rows[expected][x]) expected = y;
      for (int y = 0; y < kRows; ++y) others += std::abs(y - expected) > kApart && rows[y][x] > limits[x];
      EXPECT_EQ(best[x], expected) << x << " of " << n;
      EXPECT_EQ(most[x], rows[expected][x]) << x << " of " << n;
      EXPECT_EQ(rivals[x], others) << x << " of " << n;
    }
  }
}

TEST(ImageRows, CountWhatIsBelowALimit) {
  std::mt19937 random(kSeed);
  for (const int n : kLengths) {
    std::vector<int> values(n);
    for (int& value : values) value = static_cast<int>(random() % 100);
    for (const int limit : {0, 50, 100})
      EXPECT_EQ(count_below(values.data(), n, limit), std::ranges::count_if(values, [=](int v) { return v < limit; }));
  }
}

TEST(ImageRows, GiveThePixelsOfSomeColumns) {
  std::mt19937 random(kSeed);
  for (const int type : {CV_8UC1, CV_8UC3})
    for (const cv::Size size : {cv::Size(1, 1), cv::Size(1, 5), cv::Size(3, 4), cv::Size(40, 30)}) {
      cv::Mat image(size, type);
      const std::vector<std::uint8_t> values = bytes(random, static_cast<int>(image.total() * image.elemSize()));
      std::copy(values.begin(), values.end(), image.data);
      for (const int row_step : {1, 3}) {
        if (row_step > size.height) continue;
        std::vector<int> columns;
        for (int k = 0; k < 9; ++k) columns.push_back(static_cast<int>(random() % size.width));
        columns.push_back(size.width - 1);
        for (const std::size_t count : {columns.size(), std::size_t{1}}) {
          columns.resize(count);
          const cv::Mat sampled = sampled_columns(image, columns, row_step);
          ASSERT_EQ(sampled.size(), cv::Size(static_cast<int>(count), size.height / row_step));
          ASSERT_EQ(sampled.type(), type);
          for (int y = 0; y < sampled.rows; ++y)
            for (std::size_t k = 0; k < count; ++k)
              for (std::size_t c = 0; c < image.elemSize(); ++c)
                EXPECT_EQ(sampled.ptr(y, static_cast<int>(k))[c], image.ptr(y * row_step, columns[k])[c]);
        }
      }
    }
  EXPECT_TRUE(sampled_columns({}, {0}).empty());
}

TEST(ImageRows, AreWeakenedByDifferences) {
  std::mt19937 random(kSeed);
  for (const int n : kLengths) {
    const std::vector<float> differences = floats(random, n);
    std::vector<float> values = floats(random, n), expected;
    for (int x = 0; x < n; ++x) expected.push_back(std::min(values[x], 2 * (values[x] - std::abs(differences[x]))));
    weaken(differences.data(), 2, n, values.data());
    EXPECT_EQ(values, expected) << n;
  }
}

TEST(ImageRows, KeepWhatIsLit) {
  std::mt19937 random(kSeed);
  for (const int n : kLengths) {
    const std::vector<float> brightness = floats(random, n);
    std::vector<float> values = floats(random, n), expected = values;
    keep_lit(brightness.data(), n, values.data());
    for (int x = 0; x < n; ++x)
      if (brightness[x] <= 0) expected[x] = 0;
    EXPECT_EQ(values, expected) << n;
  }
}

class ImageRowsOf : public testing::TestWithParam<int> {};

TEST_P(ImageRowsOf, ChannelsAreAddedSplitAndMarked) {
  const int channels = GetParam();
  std::mt19937 random(kSeed);
  for (const int n : kLengths) {
    const std::vector<std::uint8_t> in = bytes(random, channels * n), dark = bytes(random, channels * n);
    for (const std::uint8_t* less : {static_cast<const std::uint8_t*>(nullptr), dark.data()}) {
      std::vector<std::int16_t> sums(channels * n), split(sums), marked(sums), expected_split(sums),
          expected_marked(sums);
      set_row(in.data(), less, channels * n, sums.data());
      add_row(in.data(), less, channels * n, sums.data());
      split_channels(sums.data(), n, channels, split.data());
      mark_channels(in.data(), 200, n, channels, marked.data());
      for (int x = 0; x < n; ++x)
        for (int c = 0; c < channels; ++c) {
          const int light = in[channels * x + c] - (less ? less[channels * x + c] : 0);
          expected_split[c * n + x] = static_cast<std::int16_t>(2 * light);
          expected_marked[c * n + x] = in[channels * x + c] >= 200;
        }
      EXPECT_EQ(split, expected_split) << n;
      EXPECT_EQ(marked, expected_marked) << n;
    }
  }
}

TEST_P(ImageRowsOf, ChannelsAreWeighedOfAsManyRowsAsAreTogether) {
  const int channels = GetParam();
  std::mt19937 random(kSeed);
  const float weights[] = {0.3f, -0.7f, 1.1f};
  for (const int n : kLengths)
    for (const int together : {1, 2, 4}) {
      const int step = channels * n + 5, dark_step = channels * n;
      const std::vector<std::uint8_t> in = bytes(random, together * step), dark = bytes(random, together * dark_step);
      for (const bool less : {false, true}) {
        const PixelRows unlit = less ? PixelRows{dark.data(), dark_step} : PixelRows{};
        std::vector<float> weighed(n), expected(n);
        weigh_pixels({in.data(), step}, unlit, together, n, channels, weights, weighed.data());
        for (int x = 0; x < n; ++x)
          for (int c = 0; c < channels; ++c) {
            int light = 0;
            for (int y = 0; y < together; ++y)
              light += in[y * step + channels * x + c] - (less ? dark[y * dark_step + channels * x + c] : 0);
            const float share = weights[c] * static_cast<float>(light);
            expected[x] = c ? expected[x] + share : share;
          }
        EXPECT_EQ(weighed, expected) << n << " columns, " << together << " rows";
      }
    }
}
INSTANTIATE_TEST_SUITE_P(SomeChannels, ImageRowsOf, testing::Values(1, 3), testing::PrintToStringParamName());

TEST(ImageRows, AreAddedUpInGroups) {
  std::mt19937 random(kSeed);
  for (const int size : {1, 2, 3, 4, 5, 6, 7, 12, 128})
    for (const int groups : {1, 13, 64}) {
      std::vector<std::int16_t> values(groups * size);
      for (std::int16_t& value : values) value = static_cast<std::int16_t>(random() % 511) - 255;
      std::vector<float> out = floats(random, groups), expected = out;
      add_groups(values.data(), groups, size, 0.1f, out.data());
      for (int g = 0; g < groups; ++g) {
        int sum = 0;
        for (int i = 0; i < size; ++i) sum += values[g * size + i];
        expected[g] += 0.1f * static_cast<float>(sum);
      }
      EXPECT_EQ(out, expected) << size;
    }
}

}  // namespace
}  // namespace tankrig
