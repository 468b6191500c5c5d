// Pieces of benchmark files that several tests write, and what a run of one leaves.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/program/program.hpp"

namespace tankrig::test {

inline const char* const kAlways = "<startOn><type>onInit</type></startOn><stopOn><type>never</type></stopOn>";

/// The measure of a cloud, called as the cloud is.
inline std::string cloud(const std::string& name) {
  return "<reconstruction3D detailedResultsToGlobals=\"true\"><name>" + name + "</name><target>object</target><topic>" +
         name + "</topic><from>base</from>" + kAlways + "</reconstruction3D>";
}

/// The rows of a folder of results.
inline nlohmann::json points_of(const std::filesystem::path& folder) {
  return nlohmann::json::parse(read_text(folder / "results.json"))["points"];
}

}  // namespace tankrig::test
