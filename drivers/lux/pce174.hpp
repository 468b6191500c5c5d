// The PCE-174 (Extech HD450) light meter on its USB-serial line.
#pragma once

#include "drivers/lux/lux_line.hpp"
#include "drivers/lux/lux_meter.hpp"
#include "drivers/lux/pce174_protocol.hpp"

namespace tankrig {

struct Pce174Settings {
  std::string device;
  Duration reply_timeout = std::chrono::milliseconds{500};  ///< of one question; it is repeated within read()'s
};

/// Lux, whatever unit the meter shows. The stamp is when the question was sent; the meter's value is up to half a
/// second older.
/// Errors: those of LuxLine; kNotReady if the meter is in hold or shows anything but the present value; kOutOfRange.
class Pce174 final : public LuxMeter {
 public:
  /// Errors: InputError, as SerialPort. A meter that is off is noticed by read().
  explicit Pce174(const Pce174Settings& settings);

  Result<LuxReading> read(Duration timeout) override;
  Statistics statistics() const override;

 private:
  LuxLine line_;
  std::uint64_t low_battery_replies_ = 0, overloads_ = 0, not_ready_ = 0;
};

}  // namespace tankrig
