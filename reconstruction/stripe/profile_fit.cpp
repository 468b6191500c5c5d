#include "reconstruction/stripe/profile_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace tankrig {
namespace {

/// Weight of the noise expected beforehand against the residuals, in degrees of freedom.
constexpr double kPriorFreedom = 8;

/// Share of the amplitude by which a real profile is off a Gauss anywhere: the faint tails are not trusted beyond it.
constexpr double kModelError = 0.02;

}  // namespace

struct ProfileFitter::Window {
  const float* values;
  int first, last;
  const float* reflectance = nullptr;  ///< of each value; none: 1, and the background a line

  double share(int i) const { return reflectance ? reflectance[i] : 1.0; }
  double ramp(int i, double t) const { return reflectance ? reflectance[i] : t; }
};

struct ProfileFitter::LinearFit {
  Eigen::Vector4d value = Eigen::Vector4d::Zero();  ///< amplitude, shift * amplitude / sd, background, slope * sd
  Eigen::Matrix4d normal = Eigen::Matrix4d::Identity();
  bool ok = false;
};

ProfileFitter::ProfileFitter(double sd, bool sloped)
    : sd_(sd),
      decay_(std::exp(-(1 / sd) * (1 / sd))),
      sloped_(sloped),
      half_window_(std::max(3, static_cast<int>(std::ceil(3 * sd)) + 1)) {
  constexpr int kSteps = 400;
  const double reach = half_window_ / sd, step = 2 * reach / kSteps;
  Eigen::Matrix2d even = Eigen::Matrix2d::Zero(), odd = Eigen::Matrix2d::Zero();
  Eigen::Vector2d even_right = Eigen::Vector2d::Zero(), odd_right = Eigen::Vector2d::Zero();
  const auto each = [&](auto&& visit) {
    for (int i = 0; i <= kSteps; ++i) {
      const double t = -reach + i * step;
      visit(t, std::exp(-0.5 * t * t));
    }
  };
  each([&](double t, double g) {
    const Eigen::Vector2d e{g, 1}, o{g * t, sloped ? t : 0};
    even += e * e.transpose();
    even_right += e * (g * (t * t - 1));
    odd += o * o.transpose();
    odd_right += o * (g * (t * t * t - 3 * t));
  });
  if (!sloped) odd(1, 1) = 1;
  const Eigen::Vector2d on_even = even.inverse() * even_right, on_odd = odd.inverse() * odd_right;
  width_on_core_ = on_even[0];
  width_on_constant_ = on_even[1];
  skew_on_shift_ = on_odd[0];
  skew_on_slope_ = on_odd[1];
  width_power_ = skew_power_ = 0;
  each([&](double t, double g) {
    width_power_ += std::pow(g * (t * t - 1) - on_even[0] * g - on_even[1], 2) * step * sd;
    skew_power_ += std::pow(g * (t * t * t - 3 * t) - on_odd[0] * g * t - on_odd[1] * t, 2) * step * sd;
  });
}

namespace {

/// exp(-t^2 / 2) at equally spaced t, by recurrence. `decay`: exp(-step^2).
class GaussWalk {
 public:
  GaussWalk(double t, double step, double decay)
      : t_(t),
        step_(step),
        g_(std::exp(-0.5 * t * t)),
        ratio_(std::exp(-t * step - 0.5 * step * step)),
        decay_(decay) {}
  double t() const { return t_; }
  double g() const { return g_; }
  void advance() {
    t_ += step_;
    g_ *= ratio_;
    ratio_ *= decay_;
  }

 private:
  double t_, step_, g_, ratio_, decay_;
};

}  // namespace

std::pair<int, int> ProfileFitter::window(int count, double start) const {
  const int middle = static_cast<int>(std::lround(start));
  return {std::max(0, middle - half_window_), std::min(count - 1, middle + half_window_)};
}

ProfileFitter::LinearFit ProfileFitter::solve(const Window& window, double centre, double contrast) const {
  const auto [values, first, last, reflectance] = window;
  const double contrast2 = contrast * contrast;
  double n = 0, gg = 0, gt = 0, g1 = 0, gs = 0, tt = 0, t1 = 0, t2 = 0, s1 = 0, s2 = 0;
  double yg = 0, yq = 0, y1 = 0, yt = 0;
  GaussWalk walk((first - centre) / sd_, 1 / sd_, decay_);
  for (int i = first; i <= last; ++i, walk.advance()) {
    const double t = walk.t(), g = walk.g() * window.share(i), s = window.ramp(i, t), y = values[i];
    const double w = contrast2 > 0 ? 1 / (1 + contrast2 * g * g) : 1, wg = w * g, wq = wg * t;
    n += w;
    gg += wg * g;
    gt += wg * g * t;
    g1 += wg;
    tt += wq * g * t;
    gs += wg * s;
    t1 += wq;
    t2 += wq * s;
    s1 += w * s;
    s2 += w * s * s;
    yg += wg * y;
    yq += wq * y;
    y1 += w * y;
    yt += w * y * s;
  }
  Eigen::Vector4d right{yg, yq, y1, yt};
  Eigen::Matrix4d normal;
  normal << gg, gt, g1, gs, gt, tt, t1, t2, g1, t1, n, s1, gs, t2, s1, s2;
  if (!sloped_ && !reflectance) {
    normal.row(3).setZero();
    normal.col(3).setZero();
    normal(3, 3) = 1;
    right[3] = 0;
  }
  LinearFit fit;
  const Eigen::LLT<Eigen::Matrix4d> factor(normal);
  if (factor.info() != Eigen::Success) return fit;
  fit.value = factor.solve(right);
  fit.normal = normal;
  fit.ok = true;
  return fit;
}

double ProfileFitter::centre_from(const Window& window, double start, LinearFit& linear) const {
  double centre = start;
  for (int iteration = 0; iteration < 8; ++iteration) {
    linear = solve(window, centre, 0);
    if (!linear.ok || linear.value[0] <= 0) return NAN;
    const double shift = std::clamp(sd_ * linear.value[1] / linear.value[0], -0.7 * sd_, 0.7 * sd_);
    centre += shift;
    if (std::abs(centre - start) > std::max(1.5, 1.5 * sd_)) return NAN;
    if (std::abs(shift) < 1e-2 * sd_) break;
  }
  return centre;
}

ProfileFit ProfileFitter::fit(const float* values, int count, double start, const ValueNoise& noise,
                              const float* reflectance) const {
  ProfileFit result;
  const auto [first, last] = window(count, start);
  if (last - first < 5) return result;
  const Window seen{values, first, last, reflectance};
  LinearFit linear;
  const double centre = centre_from(seen, start, linear);
  if (std::isnan(centre)) return result;
  result.ok = true;
  result.position = centre;
  result.amplitude = linear.value[0];
  result.amplitude_sigma = noise.additive * std::sqrt(linear.normal.inverse()(0, 0));
  refine(seen, noise, result);
  return result;
}

ProfileFit ProfileFitter::fit(const float* values, int count, double start, const ValueNoise& noise) const {
  ProfileFit result;
  const auto [first, last] = window(count, start);
  if (last - first < 5) return result;
  const Window seen{values, first, last};
  LinearFit linear;
  const double centre = centre_from(seen, start, linear);
  if (std::isnan(centre)) return result;
  double squares = 0, width = 0, skew = 0;
  GaussWalk walk((first - centre) / sd_, 1 / sd_, decay_);
  for (int i = first; i <= last; ++i, walk.advance()) {
    const double t = walk.t(), g = walk.g();
    const double residual = values[i] - linear.value[0] * g - linear.value[2] - linear.value[3] * t;
    squares += residual * residual;
    width += residual * (g * (t * t - 1) - width_on_core_ * g - width_on_constant_);
    skew += residual * (g * (t * t * t - 3 * t) - skew_on_shift_ * g * t - skew_on_slope_ * t);
  }
  const int freedom = last - first + 1 - (sloped_ ? 4 : 3);
  const double value_noise =
      std::sqrt((kPriorFreedom * noise.additive * noise.additive + squares) / (kPriorFreedom + freedom));
  const double amplitude = linear.value[0];
  result.ok = true;
  result.position = centre;
  result.amplitude = amplitude;
  result.amplitude_sigma = value_noise * std::sqrt(linear.normal.inverse()(0, 0));
  result.width_ratio = 1 + width / width_power_ / amplitude;
  result.width_sigma = value_noise / std::sqrt(width_power_) / amplitude;
  result.skewness = 6 * skew / skew_power_ / amplitude;
  result.skewness_sigma = 6 * value_noise / std::sqrt(skew_power_) / amplitude;
  refine(seen, noise, result);
  return result;
}

void ProfileFitter::refine(const Window& window, const ValueNoise& noise, ProfileFit& result) const {
  const double base = std::hypot(noise.additive, noise.contrast > 0 ? kModelError * result.amplitude : 0);
  const double contrast = noise.contrast * result.amplitude / base;
  double centre = result.position;
  LinearFit linear;
  for (int iteration = 0; iteration < 4; ++iteration) {
    const LinearFit next = solve(window, centre, contrast);
    if (!next.ok || next.value[0] <= 0) break;
    linear = next;
    const double shift = sd_ * linear.value[1] / linear.value[0];
    if (std::abs(centre + shift - result.position) > 0.7 * sd_) break;
    centre += shift;
    if (std::abs(shift) < 5e-3 * sd_) break;
  }
  if (!linear.ok) linear = solve(window, centre, 0);
  double squares = 0;
  GaussWalk walk((window.first - centre) / sd_, 1 / sd_, decay_);
  for (int i = window.first; i <= window.last; ++i, walk.advance()) {
    const double g = walk.g() * window.share(i);
    const double residual =
        window.values[i] - linear.value[0] * g - linear.value[2] - linear.value[3] * window.ramp(i, walk.t());
    squares += residual * residual / (1 + contrast * contrast * g * g);
  }
  const int freedom = window.last - window.first + 1 - (sloped_ ? 4 : 3);
  result.misfit = squares / (base * base) / freedom;
  const double value_noise = std::sqrt((kPriorFreedom * base * base + squares) / (kPriorFreedom + freedom));
  result.position = centre;
  result.sigma = value_noise * std::sqrt(linear.normal.inverse()(1, 1)) * sd_ / linear.value[0];
}

}  // namespace tankrig
