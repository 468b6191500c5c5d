#include "drivers/lux/open_lux_meter.hpp"

#include "drivers/device_path.hpp"

namespace tankrig {

LuxMeterSettings lux_meter_settings_from(const ConfigNode& lux_meter, const std::filesystem::path& runtime) {
  const std::string driver = lux_meter.choice("driver", {"pce174", "t10a"});
  const std::string device = device_path(lux_meter.text("device"), runtime);
  const Duration reply_timeout = from_seconds(lux_meter.number_or("reply_timeout_ms", 500, {20, 10000}) * 1e-3);
  if (driver == "pce174") return Pce174Settings{device, reply_timeout};
  T10aSettings s;
  s.device = device;
  s.reply_timeout = reply_timeout;
  s.head = lux_meter.integer_or("head", 0, {0, kT10aHeads - 1});
  s.colour_correction = lux_meter.flag_or("colour_correction", false);
  if (lux_meter.has("unit") && lux_meter.choice("unit", {"lux", "foot_candle"}) == "foot_candle")
    s.unit = LuxUnit::kFootCandle;
  return s;
}

std::unique_ptr<LuxMeter> open_lux_meter(const LuxMeterSettings& settings) {
  if (const auto* pce174 = std::get_if<Pce174Settings>(&settings)) return std::make_unique<Pce174>(*pce174);
  return std::make_unique<T10a>(std::get<T10aSettings>(settings));
}

std::unique_ptr<LuxMeter> open_lux_meter(const ConfigNode& lux_meter, const std::filesystem::path& runtime) {
  return open_lux_meter(lux_meter_settings_from(lux_meter, runtime));
}

}  // namespace tankrig
