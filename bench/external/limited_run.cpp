#include "bench/external/limited_run.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "bench/external/process_tree.hpp"
#include "bench/external/task_group.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

using Clock_ = std::chrono::steady_clock;

constexpr int kLook_ms = 20;
constexpr int kLooksPerAccount = 3;  // /proc and the folder are looked through this seldom
constexpr double kEnding_s = 10;     // for all that it started to be gone
// Of this user, before a bomb can start no more: beyond what a desktop or other configurations start meanwhile.
constexpr std::size_t kTaskRoom = 4096;
constexpr int kGroupRoom = 64;  // of its own group: more than it may have, so that it is seen to have too many
constexpr const char* kWell = "ended well";
constexpr const char* kRun = "run.json";  // what is run, for the supervisor

double since(Clock_::time_point begin) { return std::chrono::duration<double>(Clock_::now() - begin).count(); }

double children_cpu_s() {
  rusage use{};
  ::getrusage(RUSAGE_CHILDREN, &use);
  const auto s = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
  return s(use.ru_utime) + s(use.ru_stime);
}

/// Whatever has a name counts as a block at least. What vanishes meanwhile counts as nothing; a folder that cannot be
/// read may hold anything.
std::uint64_t bytes_below(const fs::path& folder) {
  constexpr std::uint64_t kBlock = 4096, kAnything = std::numeric_limits<std::uint64_t>::max() / 2;
  const auto hides = [](const std::error_code& problem) {
    return problem && problem != std::errc::no_such_file_or_directory && problem != std::errc::not_a_directory;
  };
  std::uint64_t sum = 0;
  std::vector<fs::path> folders{folder};
  while (!folders.empty()) {
    const fs::path one = std::move(folders.back());
    folders.pop_back();
    std::error_code problem;
    for (fs::directory_iterator entry(one, problem), end; !problem && entry != end; entry.increment(problem)) {
      std::error_code gone;
      const fs::file_type type = entry->symlink_status(gone).type();
      if (type == fs::file_type::directory) folders.push_back(entry->path());
      const std::uint64_t size = type == fs::file_type::regular ? entry->file_size(gone) : 0;
      if (hides(gone)) return kAnything;
      if (!gone) sum += std::max(size, kBlock);
    }
    if (hides(problem)) return kAnything;
  }
  return sum;
}

/// In the child: says through `failed` why the program cannot be run.
[[noreturn]] void give_up(int failed, int error) {
  (void)!::write(failed, &error, sizeof error);
  ::_exit(127);
}

void set_limit(int resource, double most, int failed) {
  const auto which = static_cast<__rlimit_resource>(resource);
  rlimit limit{};
  if (::getrlimit(which, &limit) != 0) give_up(failed, errno);
  limit.rlim_cur = limit.rlim_max = std::min(limit.rlim_max, static_cast<rlim_t>(most));
  if (::setrlimit(which, &limit) != 0) give_up(failed, errno);
}

/// In the child: the program, or give_up().
[[noreturn]] void become(const LimitedRun& run, const TaskGroup& group, std::size_t users_tasks, int failed) {
  group.enter();
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (int signal = 1; signal < NSIG; ++signal) ::signal(signal, SIG_DFL);
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  const RunLimits& limits = run.limits;
  set_limit(RLIMIT_CORE, 0, failed);
  set_limit(RLIMIT_CPU, limits.cpu_s + 1, failed);
  set_limit(RLIMIT_AS, static_cast<double>(limits.memory_bytes), failed);
  set_limit(RLIMIT_FSIZE, static_cast<double>(limits.disk_bytes), failed);
  set_limit(RLIMIT_NPROC, static_cast<double>(users_tasks + kTaskRoom) + limits.processes, failed);
  const std::string work = (run.folder / "work").string(), output = (run.folder / "output.txt").string();
  const int in = ::open("/dev/null", O_RDONLY);
  const int out = ::open(output.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND, 0600);
  if (in < 0 || out < 0 || ::chdir(work.c_str()) != 0) give_up(failed, errno);
  ::dup2(in, STDIN_FILENO);
  ::dup2(out, STDOUT_FILENO);
  ::dup2(out, STDERR_FILENO);
  ::close_range(3, static_cast<unsigned>(failed) - 1, 0);
  ::close_range(static_cast<unsigned>(failed) + 1, ~0U, 0);
  std::vector<std::string> command = run.command;
  const char* const path = ::getenv("PATH");
  std::vector<std::string> variables{"PATH=" + std::string(path ? path : "/usr/bin:/bin"), "HOME=" + work,
                                     "TMPDIR=" + work, "LANG=C.UTF-8",
                                     // a configuration has a core of its own
                                     "OMP_NUM_THREADS=1", "OPENBLAS_NUM_THREADS=1", "TBB_NUM_THREADS=1"};
  const auto pointers = [](std::vector<std::string>& words) {
    std::vector<char*> out_words;
    for (std::string& word : words) out_words.push_back(word.data());
    out_words.push_back(nullptr);
    return out_words;
  };
  ::execve(command.front().c_str(), pointers(command).data(), pointers(variables).data());
  give_up(failed, errno);
}

std::string too_much_written(const RunLimits& limits) {
  return fmt::format("wrote more than {} MiB", limits.disk_bytes >> 20);
}

/// Empty: within the limits.
std::string broken_limit(const LimitedRun& run, double cpu_before, std::uint64_t disk_before) {
  const RunLimits& limits = run.limits;
  double cpu = children_cpu_s() - cpu_before;
  std::uint64_t memory = 0;
  const std::vector<ProcessUse> processes = descendants();
  for (const ProcessUse& process : processes) cpu += process.cpu_s, memory += process.memory_bytes;
  if (processes.size() > static_cast<std::size_t>(limits.processes))
    return fmt::format("had {} processes, expected at most {}", processes.size(), limits.processes);
  if (memory > limits.memory_bytes) return fmt::format("took more than {} MiB of memory", limits.memory_bytes >> 20);
  if (cpu > limits.cpu_s) return fmt::format("took more than {:g} s of processor time", limits.cpu_s);
  if (bytes_below(run.folder) > disk_before + limits.disk_bytes) return too_much_written(limits);
  return "";
}

std::string in_words(const RunLimits& limits, int status) {
  if (WIFEXITED(status)) return WEXITSTATUS(status) == 0 ? "" : fmt::format("exit code {}", WEXITSTATUS(status));
  const int signal = WTERMSIG(status);
  if (signal == SIGXFSZ) return too_much_written(limits);
  if (signal == SIGXCPU) return fmt::format("took more than {:g} s of processor time", limits.cpu_s);
  return fmt::format("killed by signal {} ({})", signal, ::strsignal(signal));
}

/// Kills until this process has no child, which means no descendant: it adopts them.
/// Returns false if some are left.
bool end_all(pid_t group) {
  for (const Clock_::time_point begin = Clock_::now(); since(begin) < kEnding_s;) {
    ::kill(-group, SIGKILL);
    // Stopped first: what is stopped starts nothing.
    for (const int signal : {SIGSTOP, SIGKILL})
      for (const ProcessUse& process : descendants()) ::kill(process.process, signal);
    pid_t reaped = 0;
    while ((reaped = ::waitpid(-1, nullptr, WNOHANG)) > 0) {
    }
    if (reaped < 0 && errno == ECHILD) return true;
    ::poll(nullptr, 0, 1);
  }
  return false;
}

}  // namespace

std::string supervise(const LimitedRun& run, int caller) {
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  int failed[2];
  if (::pipe2(failed, O_CLOEXEC) != 0) throw InputError(std::string("pipe: ") + std::strerror(errno));
  const double cpu_before = children_cpu_s();
  const std::uint64_t disk_before = bytes_below(run.folder);
  const Clock_::time_point begin = Clock_::now();
  const std::size_t users_tasks = tasks_of_user();
  const TaskGroup group(run.limits.processes + kGroupRoom);
  const pid_t program = ::fork();
  if (program < 0) throw InputError(std::string("fork: ") + std::strerror(errno));
  if (program == 0) become(run, group, users_tasks, failed[1]);
  ::setpgid(program, program);
  ::close(failed[1]);
  int error = 0;
  const bool not_run = ::read(failed[0], &error, sizeof error) == sizeof error;
  ::close(failed[0]);

  std::optional<std::string> end;
  for (int look = 0; !end; ++look) {
    int status = 0;
    for (pid_t ended = 0; (ended = ::waitpid(-1, &status, WNOHANG)) > 0;)
      if (ended == program) end = in_words(run.limits, status);
    if (group.refused_some())  // it may be over before anybody counts
      end =
          fmt::format("had {} processes, expected at most {}", run.limits.processes + kGroupRoom, run.limits.processes);
    if (end) break;
    if (since(begin) > run.limits.wall_s) end = fmt::format("ran longer than {:g} s", run.limits.wall_s);
    if (look % kLooksPerAccount == 0)
      if (std::string broken = broken_limit(run, cpu_before, disk_before); !broken.empty()) end = std::move(broken);
    if (end) break;
    pollfd door{caller, POLLIN, 0};
    if (::poll(&door, 1, kLook_ms) > 0) end = "was stopped";
  }
  if (!end_all(program)) end = end->empty() ? "left processes that cannot be killed" : *end;
  if (not_run) end = std::string("cannot be run: ") + std::strerror(error);
  // A file at its limit ends what writes it, not what started that.
  const std::uint64_t disk = bytes_below(run.folder), most = disk_before + run.limits.disk_bytes;
  if (disk > most || (disk == most && !end->empty())) end = too_much_written(run.limits);
  return *end;
}

std::string run_limited(const std::vector<std::string>& words, const LimitedRun& run, const std::atomic<bool>& stop) {
  const RunLimits& l = run.limits;
  const nlohmann::json said_to_it{{"command", run.command},     {"wall_s", l.wall_s},
                                  {"cpu_s", l.cpu_s},           {"memory_bytes", l.memory_bytes},
                                  {"disk_bytes", l.disk_bytes}, {"processes", l.processes}};
  write_whole_file(run.folder / kRun, said_to_it.dump() + "\n");
  std::vector<std::string> arguments = words;
  arguments.push_back(run.folder.string());
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  int alive[2], verdict[2];
  if (::pipe2(alive, O_CLOEXEC) != 0) throw InputError(std::string("pipe: ") + std::strerror(errno));
  if (::pipe2(verdict, O_CLOEXEC) != 0) {
    for (const int end : alive) ::close(end);
    throw InputError(std::string("pipe: ") + std::strerror(errno));
  }
  posix_spawn_file_actions_t files;
  ::posix_spawn_file_actions_init(&files);
  ::posix_spawn_file_actions_adddup2(&files, alive[0], STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&files, verdict[1], STDOUT_FILENO);
  posix_spawnattr_t attributes;
  ::posix_spawnattr_init(&attributes);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);  // a Ctrl-C is for this process, which ends the run
  pid_t supervisor = 0;
  const int problem = ::posix_spawn(&supervisor, "/proc/self/exe", &files, &attributes, argv.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&files);
  ::close(alive[0]);
  ::close(verdict[1]);
  std::string said;
  bool open = problem == 0, holds = true;
  while (open) {
    if (stop && holds) ::close(alive[1]), holds = false;
    pollfd door{verdict[0], POLLIN, 0};
    if (::poll(&door, 1, 5 * kLook_ms) <= 0) continue;
    char buffer[512];
    const ssize_t n = ::read(verdict[0], buffer, sizeof buffer);
    if (n > 0) said.append(buffer, static_cast<std::size_t>(n));
    open = n > 0 || (n < 0 && errno == EINTR);
  }
  if (holds) ::close(alive[1]);
  ::close(verdict[0]);
  if (problem != 0) throw InputError(std::string("no process can be started: ") + std::strerror(problem));
  while (::waitpid(supervisor, nullptr, 0) < 0 && errno == EINTR) {
  }
  if (said.empty()) return "its supervisor ended without a word";
  return said == kWell ? "" : said;
}

void supervise_for_caller(const fs::path& folder) {
  const fs::path file = folder / kRun;
  LimitedRun run;
  run.folder = folder;
  try {
    const auto said = nlohmann::json::parse(read_whole_file(file));
    run.command = said.at("command").get<std::vector<std::string>>();
    run.limits = {said.at("wall_s"), said.at("cpu_s"), said.at("memory_bytes"), said.at("disk_bytes"),
                  said.at("processes")};
  } catch (const nlohmann::json::exception& e) {
    throw InputError(file, std::string("is no run of a program: ") + e.what());
  }
  if (run.command.empty()) throw InputError(file, "command: found nothing, expected a program");
  const std::string wrong = supervise(run, STDIN_FILENO);
  std::printf("%s", wrong.empty() ? kWell : wrong.c_str());
}

std::string last_words(const LimitedRun& run, const fs::path& hidden) {
  constexpr std::streamoff kTail = 4096;
  const fs::path output = run.folder / "output.txt";
  if (!fs::is_regular_file(fs::symlink_status(output))) return "";  // it may have put something else there
  std::ifstream file(output, std::ios::binary | std::ios::ate);
  if (!file) return "";
  const std::streamoff size = file.tellg();
  file.seekg(std::max<std::streamoff>(0, size - kTail));
  std::string line, last;
  while (std::getline(file, line))
    if (line.find_first_not_of(" \t\r") != std::string::npos) last = line;
  if (!hidden.empty()) last = without(std::move(last), hidden.string() + "/");
  return shown_text(last, 200);
}

}  // namespace tankrig
