#include "drivers/lux/pce174.hpp"

namespace tankrig {

Pce174::Pce174(const Pce174Settings& settings)
    : line_({.device = settings.device, .baud = 9600}, settings.reply_timeout,
            "lux meter PCE-174: no answer: switch it on (it powers off by itself) and check its cable and `driver`",
            "lux meter PCE-174: answers make no sense: check `driver` and that `device` is the meter's") {}

Result<LuxReading> Pce174::read(Duration timeout) {
  const Stamp last = MonotonicClock{}.now() + timeout;
  const auto answer = line_.ask(kPce174LiveRequest, kPce174LiveMagic, kPce174LiveBytes, decode_pce174_live, last);
  if (!answer.ok()) return answer.error();
  const Pce174Live& live = answer.value();
  if (live.low_battery) ++low_battery_replies_;
  if (live.hold || live.mode != Pce174Mode::kNormal || live.memory == Pce174Memory::kRecall) {
    ++not_ready_;
    return Error{ErrorCode::kNotReady, 0, line_.asked(),
                 live.hold ? "lux meter PCE-174: holds an old value: press HOLD"
                           : "lux meter PCE-174: shows no present value: leave max, min, peak, rel or memory mode"};
  }
  if (live.overload()) {
    ++overloads_;
    return Error{ErrorCode::kOutOfRange, 0, line_.asked(), "lux meter PCE-174: over its range: press RANGE"};
  }
  return LuxReading{line_.asked(), live.lux()};
}

Statistics Pce174::statistics() const {
  Statistics s = line_.statistics();
  s.push_back({"low_battery_replies", static_cast<double>(low_battery_replies_)});
  s.push_back({"overloads", static_cast<double>(overloads_)});
  s.push_back({"not_ready", static_cast<double>(not_ready_)});
  return s;
}

}  // namespace tankrig
