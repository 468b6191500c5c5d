// The arm's answers on CAN, from any frames that may come: eleven bytes of input a frame.
#include <cstdlib>
#include <deque>
#include <memory>

#include "drivers/arm/can_arm_link.hpp"

using namespace tankrig;

namespace {

class ListBus final : public CanBus {
 public:
  explicit ListBus(std::deque<CanFrame>& waiting) : waiting_(waiting) {}
  Status try_send(const CanFrame&) noexcept override { return {}; }
  void send_regardless(const CanFrame&) noexcept override {}
  Result<std::optional<CanFrame>> try_receive() noexcept override {
    if (waiting_.empty()) return std::optional<CanFrame>{};
    const CanFrame frame = waiting_.front();
    waiting_.pop_front();
    return std::optional<CanFrame>(frame);
  }
  CanState state() const noexcept override { return CanState::kErrorActive; }
  CanCounters counters() const noexcept override { return {}; }
  Status reopen() noexcept override { return {}; }
  int descriptor() const noexcept override { return -1; }

 private:
  std::deque<CanFrame>& waiting_;
};

constexpr std::size_t kBytesPerFrame = 11;  // identifier, length and what is asked meanwhile, eight of data

CanFrame frame_of(const std::uint8_t* b, Stamp stamp) {
  CanFrame frame;
  frame.id = static_cast<std::uint16_t>((b[0] | b[1] << 8) & 0x7FF);
  frame.length = static_cast<std::uint8_t>((b[2] & 0x0F) % 9);
  for (std::size_t i = 0; i < 8; ++i) frame.data[i] = b[3 + i];
  frame.stamp = stamp;
  return frame;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  std::deque<CanFrame> waiting;
  CanArmLink link(std::make_unique<ListBus>(waiting), ArmCanIds{}, 500'000);
  Stamp now{1'000'000'000};
  std::uint64_t answers = 0;
  ExchangeSchedule schedule(kElbow);
  for (std::size_t at = 0; at + kBytesPerFrame <= size; at += kBytesPerFrame) {
    now = now + std::chrono::microseconds{200};
    const int wish = bytes[at + 2] >> 4;
    if (wish == 1) (void)link.try_send(ArmDemands{}, ArmExchange{}, now);
    if (wish == 4) {
      (void)link.try_send(ArmDemands{}, schedule.next(), now);
      schedule.advance();
    }
    if (wish == 2) (void)link.try_send(PidSlot{}, now);
    if (wish == 3) link.forget();
    waiting.push_back(frame_of(bytes + at, now));
    const auto answer = link.try_receive(now);
    if (!answer.ok()) std::abort();  // the bus never fails
    if (answer.value()) {
      ++answers;
      if (answer.value()->read > now) std::abort();
    }
  }
  if (link.outstanding() < 0 || link.counters().answers < answers) std::abort();
  return 0;
}
