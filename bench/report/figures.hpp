// How a score's numbers are shown: with their unit, at a sensible length.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace tankrig {

/// `metrics[key]` for people: keys that end in _m become mm, _m2 and _deg stay, shares become %, counts stay; "none" if
/// null or absent.
std::string shown_figure(const nlohmann::json& metrics, const std::string& key);

/// Name of a key in words.
std::string figure_name(const std::string& key);

/// 0.01 -> "10 mm"
std::string millimetres(double metres);
/// 0.1234 -> "12.3 %"
std::string percent(double share);

}  // namespace tankrig
