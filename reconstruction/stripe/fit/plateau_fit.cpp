#include "reconstruction/stripe/fit/plateau_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace tankrig {
namespace {

constexpr double kModelError = 0.01;   ///< share of the height by which a real flank is off a Gauss
constexpr double kMaxResidual = 0.12;  ///< rms residual of the flanks over the height beyond which they are no pair
constexpr int kFlankPixels = 3;        ///< least number on either side

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;

/// centre, log e, log k, background, slope
struct Flanks {
  const std::vector<float>& values;
  ClippedRun core;
  double middle, height;
  bool sloped;
  const float* reflectance;

  struct Sums {
    Matrix5 normal = Matrix5::Zero();
    Vector5 right = Vector5::Zero();
    double squares = 0;
    int used = 0;
  };

  Sums sums(const Vector5& p) const {
    constexpr double kMaxExponent = 2;  // inside the plateau the bound is met
    Sums s;
    const double e2 = std::exp(2 * p[1]), k = std::exp(p[2]);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double x = static_cast<double>(i) - p[0], t = static_cast<double>(i) - middle;
      const bool clipped = static_cast<int>(i) >= core.first && static_cast<int>(i) <= core.last;
      const double exponent = k * (e2 - x * x);
      if (clipped && exponent > 0.5) continue;
      const double share = reflectance ? reflectance[i] : 1;
      const double g = share * height * std::exp(std::min(exponent, kMaxExponent));
      const double residual = values[i] - share * (p[3] + p[4] * t) - g;
      if (clipped && residual < 0) continue;
      Vector5 j;
      j << g * 2 * k * x, g * 2 * k * e2, g * exponent, share, sloped ? share * t : 0;
      s.normal.selfadjointView<Eigen::Lower>().rankUpdate(j);
      s.right += j * residual;
      s.squares += residual * residual;
      s.used += !clipped;
    }
    s.normal = s.normal.selfadjointView<Eigen::Lower>();
    if (!sloped) s.normal(4, 4) = 1;
    return s;
  }
};

/// Distance from the plateau's edge `from`, going by `step`, at which the values fall below `level`.
double fall(const std::vector<float>& values, int from, int step, double level) {
  for (int i = from + step; i >= 0 && i < static_cast<int>(values.size()); i += step)
    if (values[i] < level) return std::abs(i - from) - (level - values[i]) / (values[i - step] - values[i]);
  return -1;
}

}  // namespace

PlateauFit fit_plateau(const std::vector<float>& values, const ClippedRun& core, double noise, bool sloped,
                       const float* reflectance) {
  PlateauFit fit;
  const int n = static_cast<int>(values.size());
  if (core.first < kFlankPixels || core.last + kFlankPixels >= n) return fit;
  double top = 0;
  for (int i = core.first; i <= core.last; ++i) top += values[i] / core.width();
  double ends = 0, shares = 0;
  for (const int i : {0, 1, n - 2, n - 1}) ends += values[i], shares += reflectance ? reflectance[i] : 1;
  const double base = ends / shares;
  const double height = top - base, middle = 0.5 * (core.first + core.last);
  if (!(height > 8 * noise)) return fit;

  const double left = fall(values, core.first, -1, base + 0.3 * height);
  const double right = fall(values, core.last, 1, base + 0.3 * height);
  if (left < 0 || right < 0) return fit;
  const double e = 0.5 * (core.last - core.first), outer = e + 0.5 * (left + right);
  Vector5 p;
  p << middle + 0.5 * (right - left), std::log(e), std::log(1.2 / (outer * outer - e * e)), base, 0;
  const Flanks flanks{values, core, middle, height, sloped, reflectance};
  Flanks::Sums at = flanks.sums(p);
  double damping = 1e-3;
  for (int iteration = 0; iteration < 20; ++iteration) {
    Matrix5 damped = at.normal;
    damped.diagonal() *= 1 + damping;
    Vector5 step = damped.ldlt().solve(at.right);
    if (!step.allFinite()) return fit;
    step[0] = std::clamp(step[0], -1.0, 1.0);
    step[1] = std::clamp(step[1], -0.3, 0.3);
    step[2] = std::clamp(step[2], -0.7, 0.7);
    const Flanks::Sums next = flanks.sums(p + step);
    if (next.squares > at.squares * (1 + 1e-9)) {
      damping *= 10;
      if (damping > 1e6) break;
      continue;
    }
    p += step;
    at = next;
    damping = std::max(1e-9, 0.1 * damping);
    if (std::abs(step[0]) < 1e-3 && std::abs(step[1]) < 1e-2 && std::abs(step[2]) < 1e-1) break;
  }
  const int freedom = at.used - (sloped ? 5 : 4);
  const double edge = std::exp(p[1]), k = std::exp(p[2]);
  const double lean = 1 + 2 * noise / (height * 2 * k * edge);  // how far chance moves the plateau's own ends
  if (freedom < 1 || std::abs(p[0] - middle) > lean || std::abs(edge - e) > 2 * lean) return fit;
  const double flank = 2 / (k * edge);  // pixels over which both sides fall
  if (at.squares > flank * (std::pow(kMaxResidual * height, 2) + 16 * noise * noise)) return fit;

  const double expected = noise * noise + std::pow(kModelError * height, 2);
  const double variance = (kPriorFreedom * expected + at.squares) / (kPriorFreedom + freedom);
  const Matrix5 covariance = variance * at.normal.inverse();
  if (!(covariance(0, 0) > 0)) return fit;
  fit.profile.ok = true;
  fit.profile.position = p[0];
  fit.profile.sigma = std::sqrt(covariance(0, 0));
  fit.profile.amplitude = top - p[3];
  fit.profile.amplitude_sigma = noise;
  fit.profile.misfit = at.squares / expected / freedom;
  fit.profile.freedom = freedom;
  fit.sd_px = std::sqrt(0.5 / k);
  fit.half_height_px = 2 * std::sqrt(edge * edge + std::log(2.0) / k);
  return fit;
}

}  // namespace tankrig
