// What follows from the commands themselves: completion in bash and the manual page.
#include <algorithm>
#include <cstdio>
#include <functional>
#include <regex>

#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/commands.hpp"

namespace tankrig::app {
namespace {

constexpr const char* kBashFunction = R"(
_tankrig() {
  local word=${COMP_WORDS[COMP_CWORD]} command=tankrig list i
  for ((i = 1; i < COMP_CWORD; ++i)); do
    [[ ! ${_tankrig_words[$command ${COMP_WORDS[i]}]+known} ]] || command+=" ${COMP_WORDS[i]}"
  done
  local option="$command ${COMP_WORDS[COMP_CWORD - 1]}"
  if [[ ${_tankrig_values[$option]+known} ]]; then
    list=${_tankrig_values[$option]}
  else
    list=${_tankrig_words[$command]}
    [[ $word == -* ]] || list=${list%% -*}
  fi
  mapfile -t COMPREPLY < <(compgen -W "$list" -- "$word")
}
complete -o default -F _tankrig tankrig
)";

using CommandVisit = std::function<void(const std::string& name, const CLI::App& command)>;

/// `command` and all below it, parents first.
void visit_commands(const std::string& name, const CLI::App& command, const CommandVisit& visit) {
  visit(name, command);
  for (const CLI::App* below :
       command.get_subcommands([](const CLI::App* c) { return !c->get_name().empty() && !c->get_group().empty(); }))
    visit_commands(name + " " + below->get_name(), *below, visit);
}

/// Its own and those of its option groups, which CLI11 keeps as commands without a name.
std::vector<const CLI::Option*> options_with_groups(const CLI::App& command) {
  std::vector<const CLI::Option*> options = command.get_options();
  for (const CLI::App* group : command.get_subcommands([](const CLI::App* c) { return c->get_name().empty(); })) {
    for (const CLI::Option* option : options_with_groups(*group))
      if (option != group->get_help_ptr()) options.push_back(option);
  }
  return options;
}

/// " a b" of an option whose help shows {a,b}.
std::string named_values(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t begin = type.find('{'), end = type.find('}');
  if (begin == std::string::npos || end == std::string::npos) return "";
  std::string values = "," + type.substr(begin + 1, end - begin - 1);
  std::replace(values.begin(), values.end(), ',', ' ');
  return values;
}

/// Text that troff prints as it is.
std::string roff(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n')) out += "\\&";
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
    if (c == '\n') out += ".br\n";
  }
  return out;
}

std::string roff_options(const CLI::App& command) {
  const CLI::Formatter words;
  std::string out;
  for (const CLI::Option* option : options_with_groups(command)) {
    if (option == command.get_help_ptr() && command.get_parent()) continue;
    const bool positional = !option->nonpositional();
    out += ".TP\n\\fB" + roff(words.make_option_name(option, positional)) + "\\fR" +
           roff(words.make_option_opts(option)) + "\n" + roff(words.make_option_desc(option)) + "\n";
  }
  return out;
}

/// A script that completes commands, options and the values that an option names; elsewhere bash completes files.
std::string bash_completion(const CLI::App& app) {
  std::string words, values;
  visit_commands("tankrig", app, [&](const std::string& name, const CLI::App& command) {
    std::string commands, options;
    for (const CLI::App* below :
         command.get_subcommands([](const CLI::App* c) { return !c->get_name().empty() && !c->get_group().empty(); }))
      commands += " " + below->get_name();
    for (const CLI::Option* option : options_with_groups(command)) {
      if (option->get_positional()) commands += named_values(*option);
      for (const std::string& word : option->get_lnames()) {
        options += " --" + word;
        if (option->get_items_expected_max() > 0)
          values += "  ['" + name + " --" + word + "']='" + named_values(*option) + "'\n";
      }
    }
    words += "  ['" + name + "']='" + commands + options + "'\n";
  });
  return "# bash completion of tankrig " TANKRIG_VERSION
         ", from its own commands: tankrig completion bash\ndeclare -gA _tankrig_words=(\n" +
         words + ") _tankrig_values=(\n" + values + ")\n" + kBashFunction;
}

/// The manual page, as man(7) lays it out: every command with its options and its example.
std::string manual_page(const CLI::App& app) {
  std::string page = ".TH TANKRIG 1 \"\" \"tankrig " TANKRIG_VERSION "\" \"User Commands\"\n.SH NAME\n" +
                     std::regex_replace(roff(app.get_description()), std::regex("^tankrig:"), "tankrig \\-") +
                     "\n.SH SYNOPSIS\n.B tankrig\n\\fICOMMAND\\fR [\\fIOPTION\\fR...]\n.SH COMMANDS\n";
  visit_commands("tankrig", app, [&](const std::string& name, const CLI::App& command) {
    if (command.get_parent()) page += ".SS " + roff(name) + "\n" + roff(command.get_description()) + "\n";
    page += roff_options(command) + ".PP\n" + roff(command.get_footer()) + "\n";
  });
  return page + ".SH SEE ALSO\nshare/doc/tankrig/guide.md, below where tankrig is installed\n";
}

}  // namespace

void add_completion(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* c = app.add_subcommand("completion", "Print the script that lets a shell complete commands and options");
  c->footer("Example: tankrig completion bash > ~/.local/share/bash-completion/completions/tankrig");
  c->add_option("shell", "Which shell")->required()->check(CLI::IsMember({"bash"}));
  c->callback([&app, &chosen] {
    chosen = [&app] {
      std::printf("%s", bash_completion(app).c_str());
      return kOk;
    };
  });
}

void add_manual(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* c = app.add_subcommand("manual", "Print the manual page, for man");
  c->footer("Example: tankrig manual | man -l -");
  c->callback([&app, &chosen] {
    chosen = [&app] {
      std::printf("%s", manual_page(app).c_str());
      return kOk;
    };
  });
}

}  // namespace tankrig::app
