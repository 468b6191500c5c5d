#include "drivers/camera/clock_fit.hpp"

#include <algorithm>
#include <cmath>

namespace tankrig {
namespace {

constexpr double kLeastSigmaNs = 100;

double sigma_ns(const ClockSample& sample) {
  return std::max(static_cast<double>(sample.sigma.count()), kLeastSigmaNs);
}

/// How much longer the host's clock took than the device's between two samples.
double disagreement_ns(const ClockSample& from, const ClockSample& to) {
  return static_cast<double>((to.host.ns - from.host.ns) - (to.device_ns - from.device_ns));
}

}  // namespace

void ClockFit::reset() {
  window_.clear();
  suspect_.reset();
  offset_ns_ = rate_error_ = offset_sigma_ns_ = rate_sigma_ = 0;
}

std::optional<MappedStamp> ClockFit::map(std::int64_t device_ns) const {
  if (window_.empty()) return std::nullopt;
  const std::int64_t elapsed = device_ns - device0_;
  const double x = static_cast<double>(elapsed);
  const double beyond = std::max(0.0, static_cast<double>(device_ns - newest_ns_));
  const double sigma = std::hypot(offset_sigma_ns_, rate_sigma_ * x, settings_.wander_ppm * 1e-6 * beyond);
  return MappedStamp{{host0_.ns + elapsed + std::llround(offset_ns_ + rate_error_ * x)},
                     Duration{std::llround(std::min(sigma, 9e18))}};
}

bool ClockFit::agrees(const ClockSample& sample) const {
  if (window_.empty() || sample.device_ns < window_.front().device_ns) return false;
  const MappedStamp expected = *map(sample.device_ns);
  const double sigma = std::hypot(sigma_ns(sample), static_cast<double>(expected.sigma.count()));
  const double allowed =
      std::max(settings_.outlier_sigmas * sigma, static_cast<double>(settings_.outlier_floor.count()));
  return std::abs(static_cast<double>(sample.host.ns - expected.stamp.ns)) <= allowed;
}

ClockFit::Verdict ClockFit::add(const ClockSample& sample) {
  Verdict verdict = Verdict::kAccepted;
  if (!window_.empty() && !agrees(sample)) {
    if (!suspect_) {
      suspect_ = sample;
      ++outliers_;
      return Verdict::kOutlier;
    }
    const double sigma = std::hypot(sigma_ns(*suspect_), sigma_ns(sample),
                                    settings_.rate_prior_ppm * 1e-6 * seconds(sample.host - suspect_->host) * 1e9);
    const bool agree =
        sample.device_ns > suspect_->device_ns &&
        std::abs(disagreement_ns(*suspect_, sample)) <=
            std::max(settings_.outlier_sigmas * sigma, static_cast<double>(settings_.outlier_floor.count()));
    if (!agree) {
      suspect_ = sample;
      ++outliers_;
      return Verdict::kOutlier;
    }
    const ClockSample first = *suspect_;
    reset();
    window_.push_back(first);
    --outliers_;
    ++jumps_;
    verdict = Verdict::kJump;
  }
  suspect_.reset();
  window_.push_back(sample);
  while (window_.size() > settings_.window || sample.host - window_.front().host > settings_.span) window_.pop_front();
  solve();
  return verdict;
}

void ClockFit::solve() {
  // The origin at the weighted mean keeps the numbers small and makes offset and rate independent but for the prior.
  const ClockSample& first = window_.front();
  double weight = 0, mean_x = 0, mean_y = 0;
  for (const ClockSample& s : window_) {
    const double w = 1 / (sigma_ns(s) * sigma_ns(s));
    weight += w;
    mean_x += w * static_cast<double>(s.device_ns - first.device_ns);
    mean_y += w * disagreement_ns(first, s);
  }
  mean_x /= weight;
  mean_y /= weight;
  const double prior = 1 / std::pow(settings_.rate_prior_ppm * 1e-6, 2);
  double sxx = prior, sxy = 0;
  for (const ClockSample& s : window_) {
    const double w = 1 / (sigma_ns(s) * sigma_ns(s));
    const double x = static_cast<double>(s.device_ns - first.device_ns) - mean_x;
    sxx += w * x * x;
    sxy += w * x * (disagreement_ns(first, s) - mean_y);
  }
  rate_error_ = sxy / sxx;
  rate_sigma_ = 1 / std::sqrt(sxx);
  offset_sigma_ns_ = 1 / std::sqrt(weight);

  // Readings that scatter more than they claimed widen what is said of the line; less scatter narrows nothing.
  if (window_.size() >= 4) {
    double chi2 = 0;
    for (const ClockSample& s : window_) {
      const double x = static_cast<double>(s.device_ns - first.device_ns) - mean_x;
      chi2 += std::pow((disagreement_ns(first, s) - mean_y - rate_error_ * x) / sigma_ns(s), 2);
    }
    const double inflation = std::sqrt(std::max(1.0, chi2 / static_cast<double>(window_.size() - 2)));
    offset_sigma_ns_ *= inflation;
    rate_sigma_ *= inflation;
  }
  const auto whole = static_cast<std::int64_t>(std::llround(mean_x));
  device0_ = first.device_ns + whole;
  host0_ = {first.host.ns + whole};
  offset_ns_ = mean_y + rate_error_ * (static_cast<double>(whole) - mean_x);
  newest_ns_ = window_.back().device_ns;
}

std::optional<ClockSample> ArrivalEnvelope::add(std::int64_t device_ns, Stamp arrival) {
  if (!arrivals_.empty() && device_ns <= arrivals_.back().device_ns) arrivals_.clear();
  arrivals_.push_back({device_ns, arrival, {}});
  if (arrivals_.size() < frames_) return std::nullopt;
  const ClockSample& first = arrivals_.front();
  double least = 0, sum = 0;
  std::size_t earliest = 0;
  for (std::size_t i = 0; i < arrivals_.size(); ++i) {
    const double delay = disagreement_ns(first, arrivals_[i]);
    sum += delay;
    if (delay < least) {
      least = delay;
      earliest = i;
    }
  }
  // The least of n waits with mean excess m over the floor lies about m / n above it, and scatters by as much.
  const double n = static_cast<double>(arrivals_.size());
  const double excess = (sum / n - least) / n;
  ClockSample sample = arrivals_[earliest];
  sample.host.ns -= std::llround(excess);
  sample.sigma = std::max(floor_, Duration{std::llround(excess)});
  arrivals_.clear();
  return sample;
}

}  // namespace tankrig
