// The operator's console: one rig and one run at a time, any number of browsers, one of which is in control.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "console/server/access.hpp"
#include "console/server/run_request.hpp"

namespace tankrig {

struct ConsoleRig {
  nlohmann::ordered_json facts;  ///< what the page says of it
  std::vector<OfferedCommand> offered;
  std::map<std::string, std::vector<std::string>>
      questions;  ///< /api/NAME: words after the program's name that print JSON
};

struct Granted {
  nlohmann::ordered_json answer;
  std::vector<std::string> question = {};  ///< words after the program's name; what they print, JSON, is told later
};

struct ConsoleOptions {
  std::string program;            ///< its path
  std::vector<std::string> rigs;  ///< that may be chosen; the first is, at the start
  /// One of them. Asked when it is chosen, and after a run of `calibrates`. Errors: InputError; then what was known stays.
  std::function<ConsoleRig(const std::string& name)> rig;
  std::string make_safe;       ///< of what each offers, what STOP starts where nothing runs
  std::string calibrates;      ///< likewise, what may change the rig's calibration
  std::set<std::string> kept;  ///< of the questions, whose last answer all browsers are told, with its time
  /// What the page may have done without a run, by name: done at once, and answered. Errors: InputError, which the page shows.
  std::map<std::string, std::function<Granted(const nlohmann::ordered_json&)>> wishes;
  std::filesystem::path sessions;  ///< their folder
  /// Folders of results, whose files are shown as those of sessions are, by the first part of their address.
  std::map<std::string, std::filesystem::path> results;
  ListenOptions listen;
};

/// `stops`: how often an end has been asked for so far. At the first, a run is stopped, and this returns when it has ended; at the
/// second it returns at once.
/// It has no way of its own to a device: a run is a command on a terminal, STOP is that terminal's Ctrl-C, and whoever
/// dies, the browser in control or this process, takes the terminal along.
/// `ready`: is told the address, once.
/// Errors: InputError as WebServer has them.
void serve_console(const ConsoleOptions& options, const std::function<void(const std::string& address)>& ready,
                   const std::function<int()>& stops);

}  // namespace tankrig
