// Standard output belongs to results; what cannot be written there is a failure.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace tankrig::app {

/// One JSON document, indented.
void print_json(const nlohmann::ordered_json& document);

/// Call once, last.  Errors: InputError if anything printed did not reach standard output (disk full, pipe closed).
void flush_output();

}  // namespace tankrig::app
