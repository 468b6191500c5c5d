#include "console/server/run_request.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/input_error.hpp"
#include "core/range_words.hpp"
#include "core/shown_text.hpp"

namespace tankrig {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kLongestText = 500;

const char* to_string(FieldKind kind) {
  switch (kind) {
    case FieldKind::kText:
      return "text";
    case FieldKind::kNumber:
      return "number";
    case FieldKind::kChoice:
      return "choice";
    case FieldKind::kWord:
      return "word";
    case FieldKind::kFolder:
      return "folder";
  }
  return "";
}

[[noreturn]] void refuse(const RunField& field, const ordered_json& value, const std::string& expected) {
  throw InputError(fmt::format("{}: found '{}', expected {}", field.label,
                               shown_text(value.dump(-1, ' ', false, ordered_json::error_handler_t::replace)),
                               expected));
}

bool is_number(const RunField& field) {
  return field.kind == FieldKind::kNumber || (field.kind == FieldKind::kWord && field.choices.empty());
}

/// "a number from 0 to 0.1", "a whole number of at least 0".
std::string expected_number(const RunField& field) {
  std::string words = in_words(field.range);
  return field.whole ? words.insert(words.find("number"), "whole ") : words;
}

std::string number_of(const RunField& field, const ordered_json& value) {
  const double number = value.is_number() ? value.get<double>() : std::nan("");
  if (!std::isfinite(number) || !holds(field.range, number) || (field.whole && number != std::floor(number)))
    refuse(field, value, expected_number(field));
  return field.whole ? fmt::format("{:.0f}", number) : fmt::format("{}", number);
}

/// So that the page refuses it where it is typed.
ordered_json number_json(const RunField& field) {
  const auto bound = [](double end) { return std::isfinite(end) ? ordered_json(end) : ordered_json(); };
  return {{"least", bound(field.range.lower)},
          {"most", bound(field.range.upper)},
          {"whole", field.whole},
          {"expected", expected_number(field)}};
}

std::string text_of(const RunField& field, const ordered_json& value) {
  const bool text = value.is_string() && value.get<std::string>().size() <= kLongestText;
  if (!text || find_unprintable(value.get<std::string>()) != std::string::npos ||
      value.get<std::string>().find_first_of("\n\r\t") != std::string::npos)
    refuse(field, value, fmt::format("one line of at most {} characters", kLongestText));
  return value.get<std::string>();
}

std::string choice_of(const RunField& field, const ordered_json& value) {
  if (!value.is_string() || std::ranges::find(field.choices, value.get<std::string>()) == field.choices.end())
    refuse(field, value, fmt::format("one of: {}", fmt::join(field.choices, ", ")));
  return value.get<std::string>();
}

/// One folder's name: neither an option nor a way elsewhere.
std::string folder_of(const RunField& field, const ordered_json& value) {
  const std::string name = text_of(field, value);
  if (name.empty() || name.starts_with('.') || name.find('/') != std::string::npos)
    refuse(field, value, "the name of a folder in " + field.option);
  return field.option + "/" + name;
}

void add_word(const RunField& field, const ordered_json& value, std::vector<std::string>& words) {
  switch (field.kind) {
    case FieldKind::kWord:
      words.push_back(field.choices.empty() ? number_of(field, value) : choice_of(field, value));
      return;
    case FieldKind::kFolder:
      words.push_back(folder_of(field, value));
      return;
    case FieldKind::kNumber:
      words.push_back(field.option + "=" + number_of(field, value));
      return;
    case FieldKind::kChoice:
      words.push_back(field.option + "=" + choice_of(field, value));
      return;
    case FieldKind::kText:
      words.push_back(field.option + "=" + text_of(field, value));
      return;
  }
}

}  // namespace

ordered_json forms_json(const std::vector<OfferedCommand>& offered) {
  ordered_json forms = ordered_json::array();
  for (const OfferedCommand& command : offered) {
    ordered_json fields = ordered_json::array();
    for (const RunField& field : command.fields) {
      fields.push_back({{"key", field.key},
                        {"label", field.label},
                        {"kind", to_string(field.kind)},
                        {"choices", field.choices},
                        {"help", field.help},
                        {"required", field.required}});
      if (is_number(field)) fields.back()["number"] = number_json(field);
    }
    forms.push_back({{"name", command.name},
                     {"title", command.title},
                     {"what", command.what},
                     {"hold", command.hold},
                     {"moves", command.moves},
                     {"fields", fields}});
  }
  return forms;
}

const OfferedCommand& command_of(const std::vector<OfferedCommand>& offered, const ordered_json& request) {
  const std::string name = request.contains("command") && request["command"].is_string() ? request["command"] : "";
  const auto command = std::ranges::find(offered, name, &OfferedCommand::name);
  if (command == offered.end())
    throw InputError("command: found '" + shown_text(name) + "', expected one that is offered");
  return *command;
}

std::vector<std::string> words_of(const std::vector<OfferedCommand>& offered, const ordered_json& request) {
  const OfferedCommand& command = command_of(offered, request);
  std::vector<std::string> words = command.words;
  const ordered_json options = request.value("options", ordered_json::object());
  if (!options.is_object()) throw InputError("options: found no object, expected one");
  for (const auto& [key, value] : options.items())
    if (std::ranges::find(command.fields, key, &RunField::key) == command.fields.end())
      throw InputError("option: found '" + shown_text(key) + "', expected one that " + command.name + " has");
  for (const RunField& field : command.fields) {
    if (options.contains(field.key))
      add_word(field, options[field.key], words);
    else if (field.required)
      throw InputError(field.label + ": found nothing, expected a value");
  }
  return words;
}

}  // namespace tankrig
