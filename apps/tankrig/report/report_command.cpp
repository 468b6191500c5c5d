// `tankrig report`: a recorded session's scores and pages again, or a benchmark's.
#include <cstdio>

#include "apps/tankrig/bench/bench_results.hpp"
#include "apps/tankrig/command_line/feed.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/results/coverage_option.hpp"
#include "apps/tankrig/results/summary.hpp"
#include "apps/tankrig/scan/shown_scan.hpp"
#include "apps/tankrig/session/open_session.hpp"
#include "core/shown_text.hpp"
#include "pipeline/report_session.hpp"
#include "pipeline/score_session.hpp"
#include "session/recording/session_lock.hpp"

namespace tankrig::app {
namespace {

struct ReportOptions {
  std::filesystem::path session;
  std::string coverage_mm;  ///< empty: the session's
  bool json = false;
};

int report(const ReportOptions& options) {
  if (holds_benchmark(options.session)) return report_benchmark(options.session, options.json);
  Progress progress;
  const SessionLock at_rest(options.session);
  const Session session = open_with_warnings(options.session, progress).session;
  PipelineParameters parameters = pipeline_parameters(session);
  set_coverage(parameters.thresholds, options.coverage_mm);
  const StopOnSignal stop_on_signal;
  const auto scores = reconstruct_and_report(session, parameters, StopOnSignal::requested(), progress.callback());
  progress.finish_line();
  if (!scores) {
    progress.warn("stopped before the report");
    return kPartial;
  }
  warn_of(*scores, progress);
  show_scores(*scores);
  Feed::one().report(session.path / "report.html");
  if (options.json)
    print_json(scores_json(*scores));
  else
    std::printf("%s%slook at %s\n", score_table(tabled(*scores)).c_str(),
                options.coverage_mm.empty() ? "" : coverage_table(tabled(*scores)).c_str(),
                printable((session.path / "report.html").string()).c_str());
  return kOk;
}

}  // namespace

void add_report(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* c = app.add_subcommand("report",
                                   "Reconstruct and score a session again, and write its pictures and its report.html; "
                                   "or a benchmark's page from its results");
  ReportOptions& o = options_of(c, chosen, &report);
  c->footer("Example: tankrig report sessions/monday --coverage 1,2,5,10");
  add_session_option(c, o.session);
  add_coverage_option(c, o.coverage_mm);
  add_json_flag(c, o.json);
}

}  // namespace tankrig::app
