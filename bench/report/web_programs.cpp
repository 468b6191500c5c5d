#include "bench/report/web_programs.hpp"

namespace tankrig {

std::string script_json(const nlohmann::ordered_json& data) {
  std::string text = data.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
  for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at))
    text.replace(at, 1, "\\u003c");
  return text;
}

}  // namespace tankrig
