#include "drivers/lux/open_lux_meter.hpp"

#include "core/settings_table.hpp"
#include "drivers/device_path.hpp"

namespace tankrig {
namespace {

constexpr ConfigRange kReply{20, 10000};

const Setting<Pce174Settings> kPce174Rows[] = {
    {"device", &Pce174Settings::device, "its serial line, or runtime/NAME for an emulated one", Need::kRequired},
    {"reply_timeout_ms", &Pce174Settings::reply_timeout, kReply, "of one question"},
};
constexpr SettingsTable<Pce174Settings> kPce174{kPce174Rows};

const Setting<T10aSettings> kT10aRows[] = {
    {"device", &T10aSettings::device, "", Need::kRequired},
    {"reply_timeout_ms", &T10aSettings::reply_timeout, kReply, ""},
    {"head", &T10aSettings::head, ConfigRange(0, kT10aHeads - 1), "receptor head; t10a only, as what follows"},
    {"colour_correction", &T10aSettings::colour_correction, "apply the factor set on the meter"},
    {"unit", &T10aSettings::unit, "set on the meter; its answers do not tell"},
};
constexpr SettingsTable<T10aSettings> kT10a{kT10aRows};

constexpr const char* kDrivers[] = {"pce174", "t10a"};

}  // namespace

LuxMeterSettings lux_meter_settings_from(const ConfigNode& lux_meter, const std::filesystem::path& runtime) {
  const auto read = [&](auto settings, const auto& table) {
    read_settings(lux_meter, table, settings);
    settings.device = device_path(settings.device, runtime);
    return LuxMeterSettings(settings);
  };
  return lux_meter.choice("driver", {std::begin(kDrivers), std::end(kDrivers)}) == kDrivers[0]
             ? read(Pce174Settings{}, kPce174)
             : read(T10aSettings{}, kT10a);
}

std::string lux_meter_rows(const std::string& place) {
  const SettingsTable<T10aSettings> only_t10a{kT10a.rows.subspan(kPce174.rows.size())};
  return "| `" + place + ".driver` | required | pce174, t10a | PCE-174 or Extech HD450; Konica Minolta T-10A |\n" +
         settings_rows(place, kPce174) + settings_rows(place, only_t10a);
}

std::unique_ptr<LuxMeter> open_lux_meter(const LuxMeterSettings& settings) {
  if (const auto* pce174 = std::get_if<Pce174Settings>(&settings)) return std::make_unique<Pce174>(*pce174);
  return std::make_unique<T10a>(std::get<T10aSettings>(settings));
}

std::unique_ptr<LuxMeter> open_lux_meter(const ConfigNode& lux_meter, const std::filesystem::path& runtime) {
  return open_lux_meter(lux_meter_settings_from(lux_meter, runtime));
}

}  // namespace tankrig
