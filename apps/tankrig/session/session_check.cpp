// `tankrig session check` and `recover`: whether a session is whole, and how it is made so.

#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/session/open_session.hpp"
#include "core/atomic_file.hpp"
#include "core/shown_text.hpp"
#include "rig/scan/session_rig.hpp"
#include "session/checking/session_recover.hpp"
#include "session/reading/session_rig_file.hpp"
#include "session/recording/session_lock.hpp"

namespace tankrig::app {
namespace {

struct SessionCheckOptions {
  std::filesystem::path session;
  bool json = false;
};

struct SessionRecoverOptions {
  std::filesystem::path session;
  std::filesystem::path out;  ///< mend a copy here; empty: in place
  bool json = false;
};

void describe_rig(const std::filesystem::path& rig_yaml, SessionInfo& info) {
  tankrig::describe(read_rig(session_rig_file(rig_yaml.parent_path())), info);
}

const char* verdict(const SessionFindings& found) {
  return found.whole()           ? "whole"
         : !found.usable()       ? "nothing usable"
         : !found.losses.empty() ? "damaged"
         : !found.undone.empty() ? "not finished"
                                 : "whole, with files that are not of the recording";
}

nlohmann::ordered_json findings_json(const std::filesystem::path& session, const SessionFindings& found) {
  return {{"session", session.string()},
          {"verdict", verdict(found)},
          {"status", found.info.status},
          {"losses", found.losses},
          {"undone", found.undone},
          {"extra", found.extra},
          {"missing", found.missing()},
          {"recovered", found.info.recovered},
          {"joint_samples", found.joints.records.size()},
          {"frames", found.frames.records.size()},
          {"frames_in_spool", found.spooled},
          {"events", found.events.records.size()}};
}

void print_each(const char* what, const std::vector<std::string>& lines) {
  for (const std::string& line : lines) std::printf("  %s: %s\n", what, printable(line).c_str());
}

void print_findings(const std::filesystem::path& session, const SessionFindings& found) {
  std::printf("%s: %s, status \"%s\"\n", printable(session.string()).c_str(), verdict(found),
              printable(found.info.status).c_str());
  print_each("lost", found.losses);
  print_each("not finished", found.undone);
  print_each("extra", found.extra);
  print_each("lost before it was recovered", found.info.recovered);
  print_each("missing", found.missing());
  std::printf("  there: %zu frames with their pictures%s, %zu joint samples, %zu events\n", found.frames.records.size(),
              found.spooled > 0 ? (" (" + std::to_string(found.spooled) + " in the spool)").c_str() : "",
              found.joints.records.size(), found.events.records.size());
}

/// A full disk has a cure where the session is mended in place.
Recovery recovered(const SessionRecoverOptions& options, const RecoverOptions& how) {
  const std::string elsewhere =
      "; mend a copy on a disk with room: tankrig session recover " + options.session.string() + " --out DIR";
  try {
    return tankrig::recover_session(options.session, how);
  } catch (const CannotWrite& e) {
    if (!e.disk_full() || !how.out.empty()) throw;
    throw InputError(e.what() + elsewhere);
  } catch (const std::filesystem::filesystem_error& e) {
    if (e.code() != std::errc::no_space_on_device || !how.out.empty()) throw;
    throw InputError(e.path1(), e.code().message() + elsewhere);
  }
}

/// kOk: whole; kPartial: usable, its losses listed; kFailure: nothing usable.
int check_session(const SessionCheckOptions& options) {
  const SessionLock at_rest(options.session, SessionUse::kRead);
  const SessionFindings found = examine_session(options.session, describe_rig);
  if (options.json)
    print_json(findings_json(options.session, found));
  else
    print_findings(options.session, found);
  if (!found.whole() && found.usable() && !options.json)
    std::printf("  tankrig session recover %s\n", printable(options.session.string()).c_str());
  return found.whole() ? kOk : found.usable() ? kPartial : kFailure;
}

/// kOk: the session is whole now, whatever was lost before; kPartial: stopped before its end; kFailure: nothing usable.
int recover_session(const SessionRecoverOptions& options) {
  const StopOnSignal stop_on_signal;
  Progress progress;
  RecoverOptions how;
  how.out = options.out;
  how.describe = describe_rig;
  how.pictures = {[&](double fraction) { progress.update("writing pictures", fraction); },
                  [] { return StopOnSignal::requested().load(); }};
  const Recovery done = recovered(options, how);
  progress.finish_line();
  if (options.json) {
    auto out = findings_json(done.session, done.found);
    out["finished"] = done.finished;
    print_json(out);
  } else {
    print_findings(done.session, done.found);
    if (done.found.whole())
      std::printf("  nothing to do\n");
    else if (done.finished)
      std::printf("  recovered: now whole; what was replaced is in %s\n",
                  printable((done.session / "lost+found").string()).c_str());
    else if (done.found.usable())
      std::printf("  stopped while writing pictures: run it again\n");
  }
  return done.finished ? kOk : done.found.usable() ? kPartial : kFailure;
}

}  // namespace

void add_session_check(CLI::App& session, ChosenCommand& chosen) {
  CLI::App* c = session.add_subcommand(
      "check", "List what a session has lost; exit code 0: whole, 3: usable, with losses, 1: nothing usable");
  SessionCheckOptions& check = options_of(c, chosen, &check_session);
  c->footer("Example: tankrig session check sessions/monday");
  add_session_option(c, check.session);
  add_json_flag(c, check.json);
  c = session.add_subcommand("recover",
                             "Repair a damaged or interrupted session; its lost+found keeps what is replaced");
  SessionRecoverOptions& recover = options_of(c, chosen, &recover_session);
  c->footer("Example: tankrig session recover sessions/monday --out sessions/monday-recovered");
  add_session_option(c, recover.session);
  c->add_option("--out", recover.out, "Folder to make: repair a copy there (default: repair in place)");
  add_json_flag(c, recover.json);
}

}  // namespace tankrig::app
