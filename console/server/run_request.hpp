// What the page may start: commands and options in one table, from which the page makes its forms.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/config_node.hpp"

namespace tankrig {

enum class FieldKind { kText, kNumber, kChoice, kWord, kFolder };

/// One field of a form: an option, or, as kWord and kFolder, an argument without a name.
struct RunField {
  std::string key, label;
  std::string option;  ///< "--preset"; empty for a kWord; of a kFolder, where the folder lies
  FieldKind kind = FieldKind::kText;
  std::vector<std::string> choices =
      {};  ///< of kChoice and kWord: nothing else is taken. A kWord with none is a number.
  std::string help = {};
  bool required = false;
  ConfigRange range = {};  ///< of a number, as the command's own options have it
  bool whole = false;      ///< the number
};

struct OfferedCommand {
  std::string name, title, what;   ///< "scan", "Scan", what it does in a sentence
  std::vector<std::string> words;  ///< "scan", "--rig", ...: what always stands there
  std::vector<RunField> fields;
  bool hold = false;   ///< runs while a key or button is held
  bool moves = false;  ///< moves the arm or lights the laser: is asked for first
};

nlohmann::ordered_json forms_json(const std::vector<OfferedCommand>& offered);

/// The words after the program's name. `request`: {"command": NAME, "options": {KEY: VALUE}}.
/// Errors: InputError naming the command, the option, or the value that is refused.
std::vector<std::string> words_of(const std::vector<OfferedCommand>& offered, const nlohmann::ordered_json& request);

/// The command that a request names.
/// Errors: InputError.
const OfferedCommand& command_of(const std::vector<OfferedCommand>& offered, const nlohmann::ordered_json& request);

}  // namespace tankrig
