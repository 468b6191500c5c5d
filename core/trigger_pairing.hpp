// Frames of two cameras that were exposed by the same trigger.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <utility>

#include "core/clock.hpp"

namespace tankrig {

template <class Frame>
struct FramePair {
  Frame left, right;
  Duration apart{};  ///< left's mid-exposure less right's
};

struct TriggerPairingSettings {
  Duration tolerance = std::chrono::milliseconds(2);  ///< of mid-exposure, well below half a trigger period
  std::size_t most_waiting = 8;                       ///< frames that wait for a partner
};

/// Why frames stayed single; one count per frame.
struct TriggerPairingCounts {
  std::uint64_t pairs = 0;
  std::uint64_t before_first_pair = 0;  ///< the other camera was not exposing yet
  std::uint64_t partner_lost = 0;       ///< the other camera's frame of that trigger was lost on the way
  std::uint64_t off_time = 0;           ///< same trigger number, mid-exposures further apart than the tolerance
  std::uint64_t partner_missed = 0;     ///< the other camera did not expose: its numbers have no gap there
  std::uint64_t partner_silent = 0;     ///< the other camera sent nothing while `most_waiting` frames came
  std::uint64_t renumbered = 0;         ///< pairs at which the cameras' numbers shifted against one another
};

/// Pure. A pair is two frames within the tolerance. The trigger number (a camera's own sequence; the offset between the
/// cameras is learnt at each pair) tells why a frame has no partner. Each stream comes in the order of its sequence.
/// `Frame` has a std::uint64_t `sequence` and a Stamp `stamp`, the middle of its exposure.
template <class Frame>
class TriggerPairing {
 public:
  explicit TriggerPairing(const TriggerPairingSettings& settings = {}) : settings_(settings) {}

  void add_left(Frame frame) { left_.push_back(std::move(frame)); }
  void add_right(Frame frame) { right_.push_back(std::move(frame)); }
  /// Nothing until another frame comes.
  std::optional<FramePair<Frame>> next();
  const TriggerPairingCounts& counts() const { return counts_; }

 private:
  static std::int64_t number(const Frame& frame) { return static_cast<std::int64_t>(frame.sequence); }
  /// Removes the oldest frame of `own`. `shift`: its partner's number minus its own.
  void drop(std::deque<Frame>& own, const std::deque<Frame>& other, std::optional<std::int64_t> shift);
  void bound(std::deque<Frame>& own, const std::deque<Frame>& other);

  TriggerPairingSettings settings_;
  std::deque<Frame> left_, right_;
  std::optional<std::int64_t> shift_;  ///< right's number less left's
  /// Left's number of a single frame whose partner by number came, but later. Either it is off time, or its camera
  /// missed this trigger and the number belongs to the next. The next frame decides.
  std::optional<std::int64_t> doubtful_;
  TriggerPairingCounts counts_;
};

template <class Frame>
std::optional<FramePair<Frame>> TriggerPairing<Frame>::next() {
  while (!left_.empty() && !right_.empty()) {
    const Duration apart = left_.front().stamp - right_.front().stamp;
    if (apart > settings_.tolerance) {
      drop(right_, left_, shift_ ? std::optional(-*shift_) : std::nullopt);
    } else if (-apart > settings_.tolerance) {
      drop(left_, right_, shift_);
    } else {
      FramePair<Frame> pair{std::move(left_.front()), std::move(right_.front()), apart};
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

template <class Frame>
void TriggerPairing<Frame>::drop(std::deque<Frame>& own, const std::deque<Frame>& other,
                                 std::optional<std::int64_t> shift) {
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

template <class Frame>
void TriggerPairing<Frame>::bound(std::deque<Frame>& own, const std::deque<Frame>& other) {
  while (other.empty() && own.size() > settings_.most_waiting) {
    own.pop_front();
    ++counts_.partner_silent;
  }
}

}  // namespace tankrig
