#include "reconstruction/stripe/stripe.hpp"

#include <algorithm>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

struct NamedCount {
  const char* name;
  std::uint64_t StripeStatistics::*member;
};

constexpr NamedCount kCounts[] = {{"frames", &StripeStatistics::frames},
                                  {"columns", &StripeStatistics::columns},
                                  {"no_peak", &StripeStatistics::no_peak},
                                  {"low_snr", &StripeStatistics::low_snr},
                                  {"ambiguous", &StripeStatistics::ambiguous},
                                  {"too_wide", &StripeStatistics::too_wide},
                                  {"skewed", &StripeStatistics::skewed},
                                  {"edge", &StripeStatistics::edge},
                                  {"isolated", &StripeStatistics::isolated},
                                  {"peaks", &StripeStatistics::peaks},
                                  {"behind_camera", &StripeStatistics::behind_camera},
                                  {"grazing", &StripeStatistics::grazing},
                                  {"outside_workspace", &StripeStatistics::outside_workspace},
                                  {"particle", &StripeStatistics::particle},
                                  {"points", &StripeStatistics::points}};

}  // namespace

const char* to_string(StripeOrientation orientation) {
  switch (orientation) {
    case StripeOrientation::kAuto:
      return "auto";
    case StripeOrientation::kColumns:
      return "columns";
    case StripeOrientation::kRows:
      return "rows";
  }
  return "?";
}

StripeStatistics& StripeStatistics::operator+=(const StripeStatistics& other) {
  for (const NamedCount& count : kCounts) this->*count.member += other.*count.member;
  return *this;
}

std::vector<std::pair<std::string, std::uint64_t>> counts(const StripeStatistics& statistics) {
  std::vector<std::pair<std::string, std::uint64_t>> out;
  for (const NamedCount& count : kCounts) out.emplace_back(count.name, statistics.*count.member);
  return out;
}

cv::Mat median_background(const std::vector<cv::Mat>& images) {
  if (images.empty()) throw InputError("background: found no dark image, expected at least one");
  for (const cv::Mat& image : images)
    if (image.size() != images[0].size() || image.type() != images[0].type() || image.depth() != CV_8U)
      throw InputError("background: found dark images of different sizes or types, expected all alike with 8 bits");
  cv::Mat median(images[0].size(), images[0].type());
  const std::size_t n = images.size();
  const std::size_t row_bytes = static_cast<std::size_t>(median.cols) * median.channels();
  std::vector<std::uint8_t> values(n);
  for (int y = 0; y < median.rows; ++y) {
    std::uint8_t* out = median.ptr<std::uint8_t>(y);
    for (std::size_t x = 0; x < row_bytes; ++x) {
      for (std::size_t i = 0; i < n; ++i) values[i] = images[i].ptr<std::uint8_t>(y)[x];
      const auto middle = values.begin() + static_cast<std::ptrdiff_t>(n / 2);
      std::nth_element(values.begin(), middle, values.end());
      const int upper = *middle;
      out[x] = static_cast<std::uint8_t>(n % 2 ? upper : (upper + *std::max_element(values.begin(), middle) + 1) / 2);
    }
  }
  return median;
}

}  // namespace tankrig
