// Opens the lux meter of the rig file.
#pragma once

#include <filesystem>
#include <memory>
#include <variant>

#include "core/config_node.hpp"
#include "drivers/lux/pce174.hpp"
#include "drivers/lux/t10a.hpp"

namespace tankrig {

using LuxMeterSettings = std::variant<Pce174Settings, T10aSettings>;

/// The rig file's `devices: lux_meter:`.
/// Errors: InputError.
LuxMeterSettings lux_meter_settings_from(const ConfigNode& lux_meter, const std::filesystem::path& runtime);
/// Its keys, as rows of a Markdown table.
std::string lux_meter_rows(const std::string& place);

/// Errors: InputError.
std::unique_ptr<LuxMeter> open_lux_meter(const LuxMeterSettings& settings);
std::unique_ptr<LuxMeter> open_lux_meter(const ConfigNode& lux_meter, const std::filesystem::path& runtime);

}  // namespace tankrig
