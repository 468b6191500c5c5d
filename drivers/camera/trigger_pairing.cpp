#include "drivers/camera/trigger_pairing.hpp"

#include <utility>

namespace tankrig {
namespace {

std::int64_t number(const Frame& frame) { return static_cast<std::int64_t>(frame.sequence); }

}  // namespace

std::optional<FramePair> TriggerPairing::next() {
  while (!left_.empty() && !right_.empty()) {
    const Duration apart = left_.front().stamp - right_.front().stamp;
    if (apart > settings_.tolerance) {
      drop(right_, left_, shift_ ? std::optional(-*shift_) : std::nullopt);
    } else if (-apart > settings_.tolerance) {
      drop(left_, right_, shift_);
    } else {
      FramePair pair{std::move(left_.front()), std::move(right_.front()), apart};
      left_.pop_front();
      right_.pop_front();
      const std::int64_t shift = number(pair.right) - number(pair.left);
      const bool shifted = shift_ && *shift_ != shift;
      counts_.renumbered += shifted;
      if (std::exchange(doubtful_, std::nullopt)) ++(shifted ? counts_.partner_missed : counts_.off_time);
      shift_ = shift;
      ++counts_.pairs;
      return pair;
    }
  }
  bound(left_, right_);
  bound(right_, left_);
  return std::nullopt;
}

void TriggerPairing::drop(std::deque<Frame>& own, const std::deque<Frame>& other, std::optional<std::int64_t> shift) {
  const std::int64_t mine = number(own.front());
  const std::int64_t lefts = &own == &left_ ? mine : mine + shift.value_or(0);
  const std::int64_t partner = number(other.front());
  const std::optional<std::int64_t> doubtful = std::exchange(doubtful_, std::nullopt);
  if (doubtful && *doubtful == lefts) {
    counts_.off_time += 2;
  } else {
    counts_.partner_missed += doubtful.has_value();
    if (!shift)
      ++counts_.before_first_pair;
    else if (partner == mine + *shift)
      doubtful_ = lefts;
    else
      ++(partner > mine + *shift ? counts_.partner_lost : counts_.partner_missed);
  }
  own.pop_front();
}

void TriggerPairing::bound(std::deque<Frame>& own, const std::deque<Frame>& other) {
  while (other.empty() && own.size() > settings_.most_waiting) {
    own.pop_front();
    ++counts_.partner_silent;
  }
}

}  // namespace tankrig
