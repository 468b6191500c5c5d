// How often one address may ask, and try a password.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <map>
#include <string>

namespace tankrig {

/// A bucket for each address: full it holds `most` requests, and it fills at `per_second`.
class RequestLimit {
 public:
  using Time = std::chrono::steady_clock::time_point;

  RequestLimit(double most, double per_second) : most_(most), per_second_(per_second) {}

  /// True if this request is taken.
  bool take(const std::string& address, Time now) {
    if (buckets_.size() >= kMostAddresses)
      std::erase_if(buckets_, [&](const auto& b) { return level(b.second, now) >= most_; });
    if (buckets_.size() >= kMostAddresses && !buckets_.contains(address)) return false;
    Bucket& bucket = buckets_.try_emplace(address, Bucket{most_, now}).first->second;
    bucket = {level(bucket, now), now};
    if (bucket.requests < 1) return false;
    --bucket.requests;
    return true;
  }

 private:
  struct Bucket {
    double requests;
    Time at;
  };
  double level(const Bucket& bucket, Time now) const {
    return std::min(most_, bucket.requests + per_second_ * std::chrono::duration<double>(now - bucket.at).count());
  }

  static constexpr std::size_t kMostAddresses = 4096;
  const double most_, per_second_;
  std::map<std::string, Bucket> buckets_;
};

/// After each wrong password an address waits twice as long: 1 s, 2 s, ... 64 s. An hour without one is forgotten.
class LoginDelay {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Seconds = std::chrono::seconds;

  /// For how long `address` may not try; 0: it may.
  Seconds left(const std::string& address, Time now) {
    std::erase_if(failures_, [&](const auto& f) { return now - f.second.at > std::chrono::hours(1); });
    const auto failure = failures_.find(address);
    if (failure == failures_.end()) return failures_.size() < kMostAddresses ? Seconds{0} : Seconds{64};
    const auto left = failure->second.at + Seconds{1 << std::min(failure->second.count - 1, 6)} - now;
    return std::max(Seconds{0}, std::chrono::ceil<Seconds>(left));
  }
  void failed(const std::string& address, Time now) {
    Failures& failures = failures_[address];
    failures = {failures.count + 1, now};
  }
  void succeeded(const std::string& address) { failures_.erase(address); }

 private:
  struct Failures {
    int count = 0;
    Time at;
  };
  static constexpr std::size_t kMostAddresses = 4096;
  std::map<std::string, Failures> failures_;
};

}  // namespace tankrig
