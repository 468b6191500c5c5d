// What moves or shines needs somebody's word first.
#pragma once

#include <string>

namespace tankrig::app {

/// Asks "`question` [y/N]" on the terminal, unless `yes` answers already.
/// Errors: InputError if the answer is not yes, or there is no terminal to ask on.
void confirm(const std::string& question, bool yes);

}  // namespace tankrig::app
