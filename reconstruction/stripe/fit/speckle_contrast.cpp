#include "reconstruction/stripe/fit/speckle_contrast.hpp"

#include <algorithm>
#include <cmath>

#include "reconstruction/stripe/fit/section_fits.hpp"

namespace tankrig {

void ContrastScatters::add(std::size_t contrast, double square) {
  constexpr double kLeast = 1e-4;  // [px^2]
  sums_[contrast] += std::log(square + kLeast);
  ++counts_[contrast];
}

ContrastScatters& ContrastScatters::operator+=(const ContrastScatters& other) {
  for (std::size_t c = 0; c < kContrasts.size(); ++c) sums_[c] += other.sums_[c], counts_[c] += other.counts_[c];
  return *this;
}

double ContrastScatters::best() const {
  constexpr std::size_t kLeast = 20;
  std::size_t best = 0;
  const auto scatter = [&](std::size_t c) { return sums_[c] / static_cast<double>(counts_[c]); };
  for (std::size_t c = 1; c < kContrasts.size(); ++c)
    if (counts_[c] >= kLeast && (counts_[best] < kLeast || scatter(c) < scatter(best))) best = c;
  return kContrasts[best];
}

ContrastScatters scatters_along(const std::vector<StripeRun>& path, SectionFits& fits) {
  constexpr std::size_t kLag = 4, kBlock = 24, kBlocks = 16;
  std::size_t points = 0;
  for (const StripeRun& run : path) points += run.size();
  const std::size_t step = std::max(kBlock, points / kBlocks);
  std::vector<StripeRun> blocks;
  for (const StripeRun& run : path)
    for (std::size_t i = 0; i + 2 * kLag < run.size(); i += step) {
      blocks.emplace_back();
      for (std::size_t k = i; k < std::min(i + kBlock, run.size()); ++k)
        if (!fits.is_clipped(run[k])) blocks.back().push_back(run[k]);
    }
  ContrastScatters scatters;
  std::vector<double> rows;
  for (std::size_t f = 0; f < ContrastScatters::kContrasts.size(); ++f) {
    for (const StripeRun& block : blocks) {
      rows.clear();
      for (const ProfileFit& fit : fits.fit(block, ContrastScatters::kContrasts[f]))
        rows.push_back(fit.ok ? fit.position : NAN);
      for (std::size_t i = kLag; i + kLag < rows.size(); ++i) {
        const auto column = [&](std::size_t k) { return static_cast<double>(block[k].column); };
        const double share = (column(i) - column(i - kLag)) / (column(i + kLag) - column(i - kLag));
        const double d = rows[i] - (1 - share) * rows[i - kLag] - share * rows[i + kLag];
        if (!std::isnan(d)) scatters.add(f, d * d);
      }
    }
  }
  return scatters;
}

}  // namespace tankrig
