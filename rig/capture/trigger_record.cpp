#include "rig/capture/trigger_record.hpp"

#include <algorithm>
#include <cmath>

#include "core/median.hpp"

namespace tankrig {
namespace {

constexpr Duration kStampError = std::chrono::milliseconds(2);  // an exposure may seem to begin this long too early
constexpr Duration kPatience = std::chrono::seconds(1);         // of a frame for its trigger
constexpr std::size_t kDelays = 31, kLeastDelays = 3;

}  // namespace

/// False if there is no trigger before it.
bool TriggerRecord::pair(const Exposed& frame) {
  const Stamp begin = frame.middle - frame.exposure / 2 + kStampError;
  std::optional<FiredTrigger> found;
  for (; !triggers_.empty() && triggers_.front().fired <= begin; triggers_.pop_front()) {
    lost_ += found.has_value();
    found = triggers_.front();
  }
  if (!found) return false;
  delays_.push_back(frame.middle - found->fired);
  if (delays_.size() > kDelays) delays_.pop_front();
  errors_.push_back(std::abs(seconds(frame.middle - found->request.middle)));
  return true;
}

void TriggerRecord::settle(Stamp now) {
  for (; !frames_.empty(); frames_.pop_front()) {
    if (pair(frames_.front())) continue;
    if (now - frames_.front().middle < kPatience) return;
    ++untriggered_;
  }
}

void TriggerRecord::finish() {
  for (; !frames_.empty(); frames_.pop_front())
    if (!pair(frames_.front())) ++untriggered_;
  lost_ += triggers_.size();
  triggers_.clear();
}

std::optional<Duration> TriggerRecord::delay() const {
  if (delays_.size() < kLeastDelays) return std::nullopt;
  std::vector<Duration> delays(delays_.begin(), delays_.end());
  return upper_median(delays);
}

double TriggerRecord::timing_error(double share) const {
  if (errors_.empty()) return 0;
  std::vector<double> sorted = errors_;
  std::sort(sorted.begin(), sorted.end());
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(sorted.size())));
  return sorted[std::max<std::size_t>(rank, 1) - 1];
}

}  // namespace tankrig
