// tankrig: the command line. What each command does is in its own file.
#include <csignal>
#include <cstdio>
#include <exception>

#include "apps/tankrig/command_line/feed.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/commands.hpp"
#include "core/input_error.hpp"
#include "core/locked_memory.hpp"
#include "core/shown_text.hpp"

using namespace tankrig::app;

namespace {

/// Something required is missing: a word that stands where a command was expected is named beside those there are, an
/// option that nobody knows before one that is missing.
int unknown_or_missing(const CLI::App& app, const CLI::RequiredError& missing) {
  const CLI::App* parent = &app;
  std::string name = "tankrig", known;
  while (!parent->get_subcommands().empty()) {
    parent = parent->get_subcommands().front();
    name += " " + parent->get_name();
  }
  for (const CLI::App* command : parent->get_subcommands([](const CLI::App*) { return true; }))
    if (!command->get_name().empty()) known += (known.empty() ? "" : ", ") + command->get_name();
  const std::vector<std::string> words = app.remaining(true);
  if (!words.empty() && words.front().starts_with('-'))
    app.exit(CLI::ExtrasError(std::vector{tankrig::shown_text(words.front())}));
  else if (words.empty() || known.empty())
    app.exit(missing);
  else
    std::fprintf(stderr, "%s: found '%s', expected a command, one of: %s\n", name.c_str(),
                 tankrig::shown_text(words.front()).c_str(), known.c_str());
  return kUsage;
}

}  // namespace

int main(int argc, char** argv) {
  // A closed terminal or pager, or a file that may not grow, must not end a program that has an arm to stop.
  for (const int signal : {SIGPIPE, SIGXFSZ}) std::signal(signal, SIG_IGN);
  tankrig::keep_freed_memory();
  Feed::one();
  CLI::App app{"tankrig: laser-stripe and stereo reconstruction in a water tank, on a real or a simulated rig"};
  app.require_subcommand(1);
  app.set_version_flag("--version", TANKRIG_VERSION);
  app.footer("Example: tankrig scan    (scans the simulated tank and writes a report)");
  ChosenCommand chosen;
  add_commands(app, chosen);
  try {
    app.parse(argc, argv);
  } catch (const CLI::RequiredError& e) {
    return unknown_or_missing(app, e);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kUsage;
  }
  try {
    return flush_output(chosen());
  } catch (const StoppedEarly& e) {
    std::fprintf(stderr, "tankrig: %s\n", tankrig::printable(e.what()).c_str());
    return kPartial;
  } catch (const std::filesystem::filesystem_error& e) {
    std::fprintf(stderr, "tankrig: %s: %s\n", tankrig::printable(e.path1().string()).c_str(),
                 e.code().message().c_str());
    return kFailure;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "tankrig: %s\n", tankrig::printable(e.what()).c_str());
    return kFailure;
  }
}
