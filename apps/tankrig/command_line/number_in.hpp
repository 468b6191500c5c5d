// A number with bounds on the command line, refused in the words in which a rig file and the console refuse it.
#pragma once

#include <CLI/CLI.hpp>

#include "core/range_words.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"

namespace tankrig::app {

/// For check().
inline CLI::Validator number_in(const ConfigRange& range) {
  const auto refusal = [range](const std::string& text) {
    double number = 0;
    if (parse_number(text, number) && holds(range, number)) return std::string();
    return "found '" + shown_text(text) + "', expected " + in_words(range);
  };
  return {refusal, in_words(range)};
}

}  // namespace tankrig::app
