#include "drivers/lux/t10a.hpp"

#include <algorithm>

namespace tankrig {
namespace {

constexpr std::uint8_t kStart[] = {kT10aStx};

}  // namespace

T10a::T10a(const T10aSettings& settings)
    : settings_(settings),
      line_({.device = settings.device, .baud = 9600, .data_bits = 7, .parity = 'E'}, settings.reply_timeout,
            "lux meter T-10A: no answer: switch it on and check its cable, `driver` and `head`",
            "lux meter T-10A: answers make no sense: check `driver` and that `device` is the meter's") {}

Status T10a::connect(Stamp last) {
  const auto decode = [](std::span<const std::uint8_t> bytes) -> Result<T10aReply> {
    auto reply = decode_t10a_short(bytes);
    if (reply.ok() && reply.value().command != 54) return malformed_reply("T-10A: reply to another command");
    return reply;
  };
  const auto answer = line_.ask(t10a_pc_mode(), kStart, kT10aShortBytes, decode, last);
  if (!answer.ok()) return answer.error();
  connected_ = true;
  ++connections_;
  MonotonicClock clock;
  clock.sleep_until(std::min(line_.asked() + settings_.settling, last));
  return {};
}

Result<LuxReading> T10a::read(Duration timeout) {
  const MonotonicClock clock;
  const Stamp last = clock.now() + timeout;
  const auto decode = [this](std::span<const std::uint8_t> bytes) -> Result<T10aMeasurement> {
    auto m = decode_t10a_measurement(bytes);
    if (m.ok() && m.value().head != settings_.head) return malformed_reply("T-10A: reply of another head");
    return m;
  };
  for (;;) {
    if (!connected_)
      if (Status done = connect(last); !done.ok()) return done.error();
    const auto answer = line_.ask(t10a_read(settings_.head, settings_.colour_correction), kStart, kT10aLongBytes,
                                  decode, std::min(last, clock.now() + 2 * settings_.reply_timeout));
    if (answer.ok()) return judge(answer.value());
    connected_ = false;  // it may have been switched off and on: tell it again that we listen
    if (clock.now() >= last) return answer.error();
  }
}

Result<LuxReading> T10a::judge(const T10aMeasurement& m) {
  const auto refuse = [&](ErrorCode code, const char* what) -> Error {
    ++(code == ErrorCode::kOutOfRange ? overloads_ : not_ready_);
    return {code, 0, line_.asked(), what};
  };
  if (m.status.low_battery) ++low_battery_replies_;
  switch (m.status.error) {
    case '1':
      return refuse(ErrorCode::kNotReady, "lux meter T-10A: its head has no power: switch the meter off and on");
    case '2':
    case '3':
      return refuse(ErrorCode::kInternal, "lux meter T-10A: memory error: switch it off and on, then have it serviced");
    case '5':
      return refuse(ErrorCode::kOutOfRange, "lux meter T-10A: over its range");
    default:
      break;
  }
  if (m.status.hold) return refuse(ErrorCode::kNotReady, "lux meter T-10A: holds an old value: release HOLD");
  if (!m.value || *m.value < 0) return refuse(ErrorCode::kNotReady, "lux meter T-10A: has no value yet");
  return LuxReading{line_.asked(), to_lux(*m.value, settings_.unit)};
}

Statistics T10a::statistics() const {
  Statistics s = line_.statistics();
  s.push_back({"connections", static_cast<double>(connections_)});
  s.push_back({"low_battery_replies", static_cast<double>(low_battery_replies_)});
  s.push_back({"overloads", static_cast<double>(overloads_)});
  s.push_back({"not_ready", static_cast<double>(not_ready_)});
  return s;
}

}  // namespace tankrig
