#include "apps/tankrig/serve/serve_platform.hpp"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstring>

#include "apps/tankrig/bench/external_cloud.hpp"
#include "apps/tankrig/bench/scratch_folder.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/serve/score_upload.hpp"
#include "apps/tankrig/session/open_session.hpp"
#include "console/platform/archive.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"
#include "pipeline/score_session.hpp"
#include "session/checking/sha256.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

struct PublishOptions {
  fs::path session, archive;
};

bool is_plain(const std::string& name) {
  return name.size() <= 60 &&
         std::ranges::all_of(name, [](unsigned char c) { return std::isalnum(c) || c == '-' || c == '_' || c == '.'; });
}

int publish(const PublishOptions& o) {
  const OpenedSession opened = open_session(o.session);
  const std::string rig_yaml = read_whole_file(o.session / "rig.yaml");
  ScratchFolder scratch("tankrig-publish");
  write_given_session(scratch.path(), {opened.session, opened.joints, rig_yaml}, true, true);
  pack_archive(scratch.path(), o.session.filename().string(), o.archive);
  return kOk;
}

/// In a process of its own: what a session takes of memory goes with it.
void publish_apart(const std::string& program, const fs::path& session, const fs::path& archive) {
  std::vector<std::string> words{program, "serve", "publish", session, archive};
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_t process = -1;
  int status = 0;
  if (const int failure = ::posix_spawn(&process, argv[0], nullptr, nullptr, argv.data(), environ); failure != 0)
    throw InputError(program + ": " + std::strerror(failure));
  ::waitpid(process, &status, 0);
  if (status != 0) throw InputError(session, "cannot be published");
}

/// Sessions of the folder that have an object, by name; the others are named.
std::vector<Dataset> find_datasets(const PlatformCommand& options, const std::string& program) {
  std::vector<Dataset> datasets;
  const fs::path packed = options.store / "datasets";
  fs::create_directories(packed);
  for (const auto& entry : fs::directory_iterator(options.datasets)) {
    if (!fs::exists(entry.path() / "session.yaml")) continue;
    Dataset d;
    d.session = session_path(entry.path());
    d.name = d.session.filename().string();
    try {
      const Session session = Session::open(d.session);
      if (!is_plain(d.name)) throw InputError(d.session, "found this name, expected letters, digits, '.', '_' and '-'");
      if (!session.info.object) throw InputError(d.session, "has no object to score against");
      if (!fs::exists(d.session / "rig.yaml")) throw InputError(d.session, "has no rig.yaml, expected a scan");
      d.laser = has_cameras(session, "laser"), d.stereo = has_cameras(session, "stereo");
      const std::string hash = sha256_of_file(d.session / "session.yaml");
      d.archive = packed / (d.name + "-" + hash.substr(0, 16) + ".tar");
      if (!fs::exists(d.archive)) publish_apart(program, d.session, d.archive);
      d.facts = {{"rig", session.info.rig},
                 {"notes", session.info.notes},
                 {"recorded_utc", session.info.created_utc},
                 {"frames", session.frames.size()},
                 {"noise", session.info.noise},
                 {"session_sha256", hash},
                 {"archive_bytes", fs::file_size(d.archive)}};
      if (session.info.light) d.facts["light"] = *session.info.light;
      if (session.info.lux_before) d.facts["lux"] = *session.info.lux_before;
    } catch (const InputError& e) {
      fmt::print(stderr, "tankrig: {}: left out\n", printable(e.what()));
      continue;
    }
    datasets.push_back(std::move(d));
  }
  std::ranges::sort(datasets, {}, &Dataset::name);
  if (datasets.empty())
    throw InputError(options.datasets, "has no session to publish, expected folders as `tankrig scan` records them");
  return datasets;
}

}  // namespace

int run_platform(const PlatformCommand& options, const ListenOptions& listen) {
  if (!fs::is_directory(options.datasets))
    throw InputError(options.datasets, "is no folder, expected one with the sessions to publish (--datasets)");
  const StopOnSignal stop_on_signal;
  PlatformOptions platform;
  platform.program = fs::read_symlink("/proc/self/exe").string();
  platform.version = TANKRIG_VERSION;
  platform.store = fs::absolute(options.store);
  platform.datasets = find_datasets(options, platform.program);
  for (Dataset& d : platform.datasets) d.archive = fs::absolute(d.archive);
  platform.no_algorithms = sandbox_trouble();
  platform.quota = options.quota;
  platform.jobs = options.jobs;
  platform.listen = listen;
  if (!platform.no_algorithms.empty())
    fmt::print(stderr, "tankrig: algorithms are refused: {}\n", printable(platform.no_algorithms));
  serve_platform(
      platform,
      [&](const std::string& address) {
        fmt::print(
            "The platform is at {}\n{} datasets, submissions in {}. Ctrl-C ends it; its queue goes on at the next "
            "start.\n",
            address, platform.datasets.size(), printable(platform.store.string()));
        std::fflush(stdout);
      },
      [] { return StopOnSignal::requested().load(); });
  return kOk;
}

void add_platform_options(CLI::App& serve, PlatformCommand& o) {
  serve.add_flag("--platform", o.on, "The online benchmark instead of a rig (docs/reference/platform.md)")
      ->excludes(serve.get_option("--rig"));
  const char* const group = "With --platform";
  serve.add_option("--datasets", o.datasets, "Folder of the sessions to publish")->capture_default_str()->group(group);
  serve.add_option("--store", o.store, "Folder of queue, submissions and scores")->capture_default_str()->group(group);
  serve.add_option("--uploads-per-hour", o.quota.uploads_per_hour, "Of a user, and of an address")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str()
      ->group(group);
  serve.add_option("--waiting", o.quota.waiting, "Submissions of a user, and of an address, that wait at a time")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str()
      ->group(group);
  serve.add_option("--jobs", o.jobs, "Submissions scored at a time")
      ->check(CLI::Range(1, 64))
      ->capture_default_str()
      ->group(group);
}

void add_publish(CLI::App& serve, ChosenCommand& chosen) {
  CLI::App* c =
      serve.add_subcommand("publish", "Pack what others may have of a session (started by serve itself)")->group("");
  PublishOptions& o = options_of(c, chosen, &publish);
  c->footer("Example: tankrig serve publish sessions/monday monday.tar");
  add_session_option(c, o.session);
  c->add_option("archive", o.archive, ".tar to write")->required();
}

}  // namespace tankrig::app
