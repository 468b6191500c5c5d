// What a command leaves behind: results on standard output, and an exit code. What cannot be written is a failure.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace tankrig::app {

enum ExitCode : int { kOk = 0, kFailure = 1, kUsage = 2, kPartial = 3 };

/// One JSON document, indented.
void print_json(const nlohmann::ordered_json& document);

/// Call once, last, with the program's exit code; returns it. What did not reach standard output (disk full, pipe or
/// terminal closed) makes a failure of kOk; another code says more than that.
int flush_output(int code);

}  // namespace tankrig::app
