// The programs of pages that move: bundled with the libraries that they stand on when the program is built
// (cmake/web_programs.cmake). Each begins with those libraries' licence.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace tankrig {

// Empty in a build without them (TANKRIG_CLOUD_VIEW).
const std::string& cloud_view_program();  ///< draws cloud_view_json() by three.js
const std::string& plots_program();       ///< draws chart_json() by uPlot

/// For a page's head, links.html.mustache compiled in: in the console's frame its links ask the page around it.
extern const char* const kLinksTemplate;

/// Without a '<', so that a page can hold it in a <script>.
std::string script_json(const nlohmann::ordered_json& data);

}  // namespace tankrig
