// docs/measured/reliability.md as text.
#pragma once

#include <string>

#include "tests/scenarios/killed_scan.hpp"
#include "tests/scenarios/verdict.hpp"

namespace tankrig::scenarios {

/// A time after `since` [ms]; "before" it; "never".
std::string after(std::optional<Stamp> when, Stamp since);

/// `machine`: where and how it was made, a sentence.
std::string page_heading(const std::string& machine);
/// One line of the table, `why` it is wrong, or empty.
std::string page_row(const Row& row, const std::string& why);
/// The line of a trial that gave nothing.
std::string page_row(const Trial& trial, const std::string& why);
/// What has no trial, and why.
std::string page_absences();
std::string page_killed_heading();
std::string page_killed_row(const std::string& carrier, const Killed& killed, const std::string& why);
/// The line of one that gave nothing.
std::string page_killed_row(const std::string& carrier, Ending ending, const std::string& why);

}  // namespace tankrig::scenarios
