#include "reconstruction/stripe/fit/profile_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "reconstruction/stripe/lanes.hpp"

namespace tankrig {
namespace {

/// Share of the amplitude by which a real profile is off a Gauss anywhere: the faint tails are not trusted beyond it.
constexpr double kModelError = 0.02;

ProfileShape shape_of(double sd, bool sloped) {
  ProfileShape shape{};
  shape.sd = sd;
  shape.decay = std::exp(-(1 / sd) * (1 / sd));
  shape.sloped = sloped;
  shape.half_window = std::max(3, static_cast<int>(std::ceil(3 * sd)) + 1);
  constexpr int kSteps = 400;
  const double reach = shape.half_window / sd, step = 2 * reach / kSteps;
  Eigen::Matrix2d even = Eigen::Matrix2d::Zero(), odd = Eigen::Matrix2d::Zero();
  Eigen::Vector2d even_right = Eigen::Vector2d::Zero(), odd_right = Eigen::Vector2d::Zero();
  std::array<double, kSteps + 1> gauss;
  const auto t_at = [=](int i) { return -reach + i * step; };
  for (int i = 0; i <= kSteps; ++i) gauss[i] = std::exp(-0.5 * t_at(i) * t_at(i));
  const auto each = [&](auto&& visit) {
    for (int i = 0; i <= kSteps; ++i) visit(t_at(i), gauss[i]);
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
  shape.width_on_core = on_even[0];
  shape.width_on_constant = on_even[1];
  shape.skew_on_shift = on_odd[0];
  shape.skew_on_slope = on_odd[1];
  each([&](double t, double g) {
    shape.width_power += std::pow(g * (t * t - 1) - on_even[0] * g - on_even[1], 2) * step * sd;
    shape.skew_power += std::pow(g * (t * t * t - 3 * t) - on_odd[0] * g * t - on_odd[1] * t, 2) * step * sd;
  });
  return shape;
}

// From here on `Real` is a double, for one section, or four, for as many with windows of one length.

template <class Real>
struct alignas(kLaneAlignment) Window {
  const double* values;       ///< those of all lanes at the first place, then at the next
  const double* reflectance;  ///< of each value; none: 1, and the background a line
  int count;
  Real first;  ///< index of the first value in its section

  static constexpr int kStep = sizeof(Real) / sizeof(double);
  inline __attribute__((always_inline)) Real value(int i) const { return load<Real>(values + kStep * i); }
  inline __attribute__((always_inline)) Real share(int i) const {
    return reflectance ? load<Real>(reflectance + kStep * i) : Real{} + 1;
  }
  inline __attribute__((always_inline)) Real ramp(int i, const Real& t) const {
    return reflectance ? load<Real>(reflectance + kStep * i) : t;
  }
};

/// exp(-t^2 / 2) at equally spaced t, by recurrence.
template <class Real>
struct alignas(kLaneAlignment) GaussWalk {
  Real t, g, ratio;
  double step, decay;

  inline __attribute__((always_inline))
  GaussWalk(const ProfileShape& shape, const Window<Real>& window, const Real& centre)
      : t((window.first - centre) / shape.sd), step(1 / shape.sd), decay(shape.decay) {
    g = exponential(-0.5 * t * t);
    ratio = exponential(-t * step - 0.5 * step * step);
  }
  inline __attribute__((always_inline)) void advance() {
    t += step;
    g *= ratio;
    ratio *= decay;
  }
};

constexpr int kModel = 4;  ///< amplitude, shift * amplitude / sd, background, slope * sd

template <class Real>
struct alignas(kLaneAlignment) LinearFit {
  Real value[kModel];
  Real lower[kModel][kModel],
      diagonal[kModel];  ///< the normal matrix is lower * diagonal * lower^T, below the diagonal
  Mask<Real> ok;
};

template <class Real>
inline __attribute__((always_inline)) void take_where(const Mask<Real>& mask, const LinearFit<Real>& from,
                                                      LinearFit<Real>& to) {
  for (int i = 0; i < kModel; ++i) {
    to.value[i] = mask ? from.value[i] : to.value[i];
    to.diagonal[i] = mask ? from.diagonal[i] : to.diagonal[i];
    for (int j = 0; j < i; ++j) to.lower[i][j] = mask ? from.lower[i][j] : to.lower[i][j];
  }
}

/// `normal`: its lower triangle, row by row.
template <class Real>
inline __attribute__((always_inline)) LinearFit<Real> solve_normal(const Real (&normal)[kModel * (kModel + 1) / 2],
                                                                   const Real (&right)[kModel]) {
  LinearFit<Real> fit;
  fit.ok = Real{} == 0;
  for (int j = 0; j < kModel; ++j) {
    fit.diagonal[j] = normal[j * (j + 1) / 2 + j];
    for (int k = 0; k < j; ++k) fit.diagonal[j] -= fit.lower[j][k] * fit.lower[j][k] * fit.diagonal[k];
    fit.ok &= fit.diagonal[j] > 0;
    for (int i = j + 1; i < kModel; ++i) {
      Real left = normal[i * (i + 1) / 2 + j];
      for (int k = 0; k < j; ++k) left -= fit.lower[i][k] * fit.lower[j][k] * fit.diagonal[k];
      fit.lower[i][j] = left / fit.diagonal[j];
    }
  }
  for (int i = 0; i < kModel; ++i) {
    fit.value[i] = right[i];
    for (int k = 0; k < i; ++k) fit.value[i] -= fit.lower[i][k] * fit.value[k];
  }
  for (int i = kModel - 1; i >= 0; --i) {
    fit.value[i] /= fit.diagonal[i];
    for (int k = i + 1; k < kModel; ++k) fit.value[i] -= fit.lower[k][i] * fit.value[k];
  }
  return fit;
}

/// Of one unknown, for noise of 1.
template <int at, class Real>
inline __attribute__((always_inline)) Real variance_of(const LinearFit<Real>& fit) {
  alignas(kLaneAlignment) Real column[kModel] = {};
  Real sum = {};
  column[at] += 1;
  for (int i = at; i < kModel; ++i) {
    for (int k = at; k < i; ++k) column[i] -= fit.lower[i][k] * column[k];
    sum += column[i] * column[i] / fit.diagonal[i];
  }
  return sum;
}

/// `contrast`: of the stripe's light, over the noise that is the same for all values; `weighted`: it is not 0 everywhere.
template <class Real>
inline __attribute__((always_inline)) LinearFit<Real> solve(const ProfileShape& shape, const Window<Real>& window,
                                                            const Real& centre, const Real& contrast, bool weighted) {
  const Real contrast2 = contrast * contrast, one = Real{} + 1;
  Real n = {}, gg = {}, gt = {}, g1 = {}, gs = {}, tt = {}, t1 = {}, t2 = {}, s1 = {}, s2 = {};
  Real yg = {}, yq = {}, y1 = {}, yt = {};
  GaussWalk<Real> walk(shape, window, centre);
  for (int i = 0; i < window.count; ++i, walk.advance()) {
    const Real t = walk.t, g = walk.g * window.share(i), s = window.ramp(i, t), y = window.value(i);
    const Real w = weighted ? 1 / (1 + contrast2 * g * g) : one, wg = w * g, wq = wg * t;
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
  const Real none = {};
  if (!shape.sloped && !window.reflectance) {
    alignas(kLaneAlignment) const Real normal[] = {gg, gt, tt, g1, t1, n, none, none, none, one};
    alignas(kLaneAlignment) const Real right[kModel] = {yg, yq, y1, none};
    return solve_normal(normal, right);
  }
  alignas(kLaneAlignment) const Real normal[] = {gg, gt, tt, g1, t1, n, gs, t2, s1, s2};
  alignas(kLaneAlignment) const Real right[kModel] = {yg, yq, y1, yt};
  return solve_normal(normal, right);
}

template <class Real>
int freedom_of(const ProfileShape& shape, const Window<Real>& window) {
  return window.count - (shape.sloped || window.reflectance ? kModel : kModel - 1);
}

template <class Real>
struct alignas(kLaneAlignment) Fitted {
  Mask<Real> ok;
  Real position, sigma, amplitude, amplitude_sigma, width_ratio, width_sigma, skewness, skewness_sigma, misfit;
  int freedom;
};

/// The centre with all values alike, and the fit there; false where there is none.
template <class Real>
inline __attribute__((always_inline)) Mask<Real> find_centre(const ProfileShape& shape, const Window<Real>& window,
                                                             const Real& start, Real& centre, LinearFit<Real>& linear) {
  centre = start;
  Mask<Real> moves = Real{} == 0, ok = moves;
  for (int iteration = 0; iteration < 8 && any(moves); ++iteration) {
    const LinearFit<Real> next = solve(shape, window, centre, Real{}, false);
    if (iteration == 0)
      linear = next;
    else
      take_where(moves, next, linear);
    const Real shift = clamped(shape.sd * next.value[1] / next.value[0], -0.7 * shape.sd, 0.7 * shape.sd);
    ok =
        moves ? next.ok & (next.value[0] > 0) & (size_of(centre + shift - start) <= std::max(1.5, 1.5 * shape.sd)) : ok;
    moves &= ok;
    centre = moves ? centre + shift : centre;
    moves &= size_of(shift) >= 1e-2 * shape.sd;
  }
  return ok;
}

/// What the residuals say of the noise, width and skewness. Those of an edge say nothing of the last two.
template <class Real>
inline __attribute__((always_inline)) void measure_residuals(const ProfileShape& shape, const Window<Real>& window,
                                                             const LinearFit<Real>& linear, double noise,
                                                             Fitted<Real>& fitted) {
  const Real amplitude = linear.value[0];
  fitted.width_ratio = Real{} + 1;
  fitted.amplitude_sigma = noise * root(variance_of<0>(linear));
  if (window.reflectance) return;
  Real squares = {}, width = {}, skew = {};
  GaussWalk<Real> walk(shape, window, fitted.position);
  for (int i = 0; i < window.count; ++i, walk.advance()) {
    const Real t = walk.t, g = walk.g;
    const Real residual = window.value(i) - amplitude * g - linear.value[2] - linear.value[3] * t;
    squares += residual * residual;
    width += residual * (g * (t * t - 1) - shape.width_on_core * g - shape.width_on_constant);
    skew += residual * (g * (t * t * t - 3 * t) - shape.skew_on_shift * g * t - shape.skew_on_slope * t);
  }
  const int freedom = freedom_of(shape, window);
  const Real value_noise = root((kPriorFreedom * noise * noise + squares) / (kPriorFreedom + freedom));
  fitted.amplitude_sigma = value_noise * root(variance_of<0>(linear));
  fitted.width_ratio = 1 + width / shape.width_power / amplitude;
  fitted.width_sigma = value_noise / std::sqrt(shape.width_power) / amplitude;
  fitted.skewness = 6 * skew / shape.skew_power / amplitude;
  fitted.skewness_sigma = 6 * value_noise / std::sqrt(shape.skew_power) / amplitude;
}

/// The centre by weighted values, and its sigma. `linear`: the fit so far.
template <class Real>
inline __attribute__((always_inline)) void refine(const ProfileShape& shape, const Window<Real>& window,
                                                  const ValueNoise& noise, LinearFit<Real>& linear,
                                                  Fitted<Real>& fitted) {
  const bool weighted = noise.contrast > 0;
  const Real modelled = (weighted ? kModelError : 0.0) * fitted.amplitude;
  const Real base = root(noise.additive * noise.additive + modelled * modelled);
  const Real contrast = noise.contrast * fitted.amplitude / base;
  Real centre = fitted.position;
  Mask<Real> moves = fitted.ok;
  for (int iteration = 0; iteration < 4 && any(moves); ++iteration) {
    const LinearFit<Real> next = solve(shape, window, centre, contrast, weighted);
    moves &= next.ok & (next.value[0] > 0);
    take_where(moves, next, linear);
    const Real shift = shape.sd * next.value[1] / next.value[0];
    moves &= size_of(centre + shift - fitted.position) <= 0.7 * shape.sd;
    centre = moves ? centre + shift : centre;
    moves &= size_of(shift) >= 5e-3 * shape.sd;
  }
  Real squares = {};
  GaussWalk<Real> walk(shape, window, centre);
  for (int i = 0; i < window.count; ++i, walk.advance()) {
    const Real g = walk.g * window.share(i);
    const Real residual =
        window.value(i) - linear.value[0] * g - linear.value[2] - linear.value[3] * window.ramp(i, walk.t);
    squares += weighted ? residual * residual / (1 + contrast * contrast * g * g) : residual * residual;
  }
  fitted.freedom = freedom_of(shape, window);
  fitted.misfit = squares / (base * base) / fitted.freedom;
  const Real value_noise = root((kPriorFreedom * base * base + squares) / (kPriorFreedom + fitted.freedom));
  fitted.position = centre;
  fitted.sigma = value_noise * root(variance_of<1>(linear)) * shape.sd / linear.value[0];
}

/// `start`: in the index of the values, as the position.
template <class Real>
inline __attribute__((always_inline)) Fitted<Real> fit_window(const ProfileShape& shape, const Window<Real>& window,
                                                              const Real& start, const ValueNoise& noise) {
  Fitted<Real> fitted = {};
  LinearFit<Real> linear;
  fitted.ok = find_centre(shape, window, start, fitted.position, linear);
  if (!any(fitted.ok)) return fitted;
  fitted.amplitude = linear.value[0];
  measure_residuals(shape, window, linear, noise.additive, fitted);
  refine(shape, window, noise, linear, fitted);
  return fitted;
}

/// `first`, `start`: of each lane.
TANKRIG_VECTORISED
void fit_lanes(const ProfileShape& shape, const double* values, int count, const double* first, const double* start,
               const ValueNoise& noise, Fitted<FourDoubles>& fitted) {
  const Window<FourDoubles> window{values, nullptr, count, load<FourDoubles>(first)};
  fitted = fit_window(shape, window, load<FourDoubles>(start), noise);
}

ProfileFit lane_of(const Fitted<FourDoubles>& f, int k) {
  if (!f.ok[k]) return {};
  return {.ok = true,
          .position = f.position[k],
          .sigma = f.sigma[k],
          .amplitude = f.amplitude[k],
          .amplitude_sigma = f.amplitude_sigma[k],
          .width_ratio = f.width_ratio[k],
          .width_sigma = f.width_sigma[k],
          .skewness = f.skewness[k],
          .skewness_sigma = f.skewness_sigma[k],
          .misfit = f.misfit[k],
          .freedom = f.freedom};
}

}  // namespace

ProfileFitter::ProfileFitter(double sd, bool sloped) : shape_(shape_of(sd, sloped)) {}

std::pair<int, int> ProfileFitter::window(int count, double start) const {
  const int middle = static_cast<int>(std::lround(start));
  return {std::max(0, middle - shape_.half_window), std::min(count - 1, middle + shape_.half_window)};
}

ProfileFit ProfileFitter::fit(const ProfileSection& section, const ValueNoise& noise) const {
  const auto [first, last] = window(section.count, section.start);
  if (last - first < 5) return {};
  thread_local std::vector<double> values, reflectance;
  values.assign(section.values + first, section.values + last + 1);
  if (section.reflectance) reflectance.assign(section.reflectance + first, section.reflectance + last + 1);
  const Window<double> seen{values.data(), section.reflectance ? reflectance.data() : nullptr, last - first + 1,
                            static_cast<double>(first)};
  const Fitted<double> f = fit_window(shape_, seen, section.start, noise);
  if (!f.ok) return {};
  return {.ok = true,
          .position = f.position,
          .sigma = f.sigma,
          .amplitude = f.amplitude,
          .amplitude_sigma = f.amplitude_sigma,
          .width_ratio = f.width_ratio,
          .width_sigma = f.width_sigma,
          .skewness = f.skewness,
          .skewness_sigma = f.skewness_sigma,
          .misfit = f.misfit,
          .freedom = f.freedom};
}

std::vector<ProfileFit> ProfileFitter::fit(std::span<const ProfileSection> sections, const ValueNoise& noise) const {
  const int length = 2 * shape_.half_window + 1;
  std::vector<ProfileFit> fits(sections.size());
  std::vector<double> values(static_cast<std::size_t>(length) * kLanes);
  std::array<double, kLanes> first{}, start{};
  std::array<std::size_t, kLanes> at;
  int taken = 0;
  const auto fit_taken = [&] {
    Fitted<FourDoubles> fitted;
    fit_lanes(shape_, values.data(), length, first.data(), start.data(), noise, fitted);
    for (int k = 0; k < taken; ++k) fits[at[k]] = lane_of(fitted, k);
    taken = 0;
  };
  for (std::size_t i = 0; i < sections.size(); ++i) {
    const ProfileSection& section = sections[i];
    const auto [from, to] = window(section.count, section.start);
    if (section.reflectance || to - from + 1 < length) {
      fits[i] = fit(section, noise);
      continue;
    }
    for (int k = 0; k < length; ++k) values[k * kLanes + taken] = section.values[from + k];
    first[taken] = from;
    start[taken] = section.start;
    at[taken] = i;
    if (++taken == kLanes) fit_taken();
  }
  if (taken > 0) fit_taken();
  return fits;
}

}  // namespace tankrig
