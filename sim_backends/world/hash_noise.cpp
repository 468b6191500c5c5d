// The table behind GaussianTable.
#include "sim_backends/world/hash_noise.hpp"

#include <cmath>
#include <numbers>

namespace tankrig::sim {
namespace {

double normal_cdf(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }
double normal_pdf(double x) { return std::exp(-0.5 * x * x) / std::sqrt(2 * std::numbers::pi); }

/// x with normal_cdf(x) = p, p in (0, 1/2].
double normal_quantile(double p) {
  double x = p > 0.02 ? 0.0 : -2.5;
  for (int i = 0; i < 30; ++i) x -= (normal_cdf(x) - p) / normal_pdf(x);
  return x;
}

/// Means of N equally probable slices of the normal distribution, scaled to the variance 1/2.
template <std::size_t N>
void fill(std::array<float, N>& table) {
  std::array<double, N / 2> mean{};
  double square = 0, left_pdf = 0;
  for (std::size_t i = 0; i < N / 2; ++i) {
    const double right_pdf = normal_pdf(normal_quantile(static_cast<double>(i + 1) / N));
    mean[i] = (left_pdf - right_pdf) * N;
    square += 2 * mean[i] * mean[i] / N;
    left_pdf = right_pdf;
  }
  const double scale = std::sqrt(0.5 / square);
  for (std::size_t i = 0; i < N / 2; ++i) {
    table[i] = static_cast<float>(mean[i] * scale);
    table[N - 1 - i] = -table[i];
  }
}

}  // namespace

GaussianTable::GaussianTable() {
  fill(coarse_);
  fill(fine_);
}

const GaussianTable& GaussianTable::instance() {
  static const GaussianTable table;
  return table;
}

}  // namespace tankrig::sim
