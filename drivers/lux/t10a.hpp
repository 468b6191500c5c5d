// The Konica Minolta T-10A illuminance meter on its USB-serial line.
#pragma once

#include "drivers/lux/lux_line.hpp"
#include "drivers/lux/lux_meter.hpp"
#include "drivers/lux/lux_protocol.hpp"
#include "drivers/lux/t10a_protocol.hpp"

namespace tankrig {

struct T10aSettings {
  std::string device;
  int head = 0;                                             ///< receptor head, 0 .. 29
  bool colour_correction = false;                           ///< apply the factor set on the meter
  LuxUnit unit = LuxUnit::kLux;                             ///< set on the meter; its answers do not tell
  Duration reply_timeout = std::chrono::milliseconds{500};  ///< of one question; it is repeated within read()'s
  Duration settling = std::chrono::milliseconds{500};       ///< after it was told that a computer is connected
};

/// The stamp is when the question was sent; the meter's value is up to half a second older.
/// Errors: those of LuxLine; kNotReady (hold, head without power, still settling or choosing its range), kOutOfRange,
/// kInternal (its memory has failed).
class T10a final : public LuxMeter {
 public:
  /// Errors: InputError, as SerialPort. A meter that is off is noticed by read().
  explicit T10a(const T10aSettings& settings);

  Result<LuxReading> read(Duration timeout) override;
  Statistics statistics() const override;

 private:
  Status connect(Stamp last);
  Result<LuxReading> judge(const T10aMeasurement& m);

  const T10aSettings settings_;
  LuxLine line_;
  bool connected_ = false;
  std::uint64_t connections_ = 0, low_battery_replies_ = 0, overloads_ = 0, not_ready_ = 0;
};

}  // namespace tankrig
