// What moves or shines needs somebody's word first.
#pragma once

#include <optional>
#include <string>

namespace tankrig::app {

/// A line that somebody types on the terminal; none if a stop is asked for first, or the terminal is gone.
std::optional<std::string> typed_line();

/// Asks "`question` [y/N]" on the terminal, unless `yes` answers already.
/// Errors: InputError if the answer is not yes, or there is no terminal to ask on.
void confirm(const std::string& question, bool yes);

}  // namespace tankrig::app
