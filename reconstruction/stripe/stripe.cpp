#include "reconstruction/stripe/stripe.hpp"

#include <tbb/parallel_for.h>

#include "core/input_error.hpp"
#include "reconstruction/stripe/find/image_rows.hpp"

namespace tankrig {
namespace {

struct NamedCount {
  const char* name;
  std::uint64_t StripeStatistics::*member;
};

constexpr NamedCount kCounts[] = {
    {"frames", &StripeStatistics::frames},     {"hazy_frames", &StripeStatistics::hazy_frames},
    {"columns", &StripeStatistics::columns},   {"no_peak", &StripeStatistics::no_peak},
    {"low_snr", &StripeStatistics::low_snr},   {"ambiguous", &StripeStatistics::ambiguous},
    {"too_wide", &StripeStatistics::too_wide}, {"skewed", &StripeStatistics::skewed},
    {"edge", &StripeStatistics::edge},         {"isolated", &StripeStatistics::isolated},
    {"peaks", &StripeStatistics::peaks},       {"behind_camera", &StripeStatistics::behind_camera},
    {"grazing", &StripeStatistics::grazing},   {"outside_workspace", &StripeStatistics::outside_workspace},
    {"particle", &StripeStatistics::particle}, {"points", &StripeStatistics::points}};

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
  const int n = static_cast<int>(images.size()), row_bytes = median.cols * median.channels();
  tbb::parallel_for(0, median.rows, [&](int y) {
    std::vector<const std::uint8_t*> rows;
    for (const cv::Mat& image : images) rows.push_back(image.ptr<std::uint8_t>(y));
    std::uint8_t* out = median.ptr<std::uint8_t>(y);
    select_bytes(rows.data(), n, n / 2, row_bytes, out);
    if (n % 2) return;
    std::vector<std::uint8_t> lower(row_bytes);
    select_bytes(rows.data(), n, n / 2 - 1, row_bytes, lower.data());
    for (int x = 0; x < row_bytes; ++x) out[x] = static_cast<std::uint8_t>((out[x] + lower[x] + 1) / 2);
  });
  return median;
}

}  // namespace tankrig
