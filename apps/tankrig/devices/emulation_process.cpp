#include "apps/tankrig/devices/emulation_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <string>
#include <system_error>
#include <vector>

#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/command_line/waiting.hpp"
#include "apps/tankrig/devices/world_options.hpp"
#include "core/clock.hpp"
#include "core/input_error.hpp"

namespace tankrig::app {
namespace {

using namespace std::chrono_literals;

constexpr auto kReadyTimeout = 300s;  // loading the scene takes most of it; one that dies is noticed at once
constexpr auto kEndTimeout = 5s;
constexpr std::chrono::milliseconds kReadyLook = 200ms;

std::vector<std::string> arguments(const RigConfig& rig, const BackendOptions& options,
                                   const std::filesystem::path& runtime, int ready) {
  std::vector<std::string> out{"tankrig",    "emulate",
                               "--rig",      rig.file.string(),
                               "--runtime",  runtime,
                               "--ready-fd", std::to_string(ready),
                               "--seed",     std::to_string(options.world.seed)};
  const auto add = [&](const char* name, const std::string& value) { out.insert(out.end(), {name, value}); };
  if (!options.need.cameras)
    for (const char* device : {"arm", "laser", "box"}) add("--device", device);
  if (!options.faults.empty()) add("--faults", std::filesystem::absolute(options.faults));
  const std::vector<std::string> world = option_words(options.world);
  out.insert(out.end(), world.begin(), world.end());
  return out;
}

/// Waits for one byte; false at the end of the pipe or of the time, or if a signal asks to stop.
bool wait_ready(int pipe, pid_t process) {
  const Waiting told("the emulated devices to be ready: process " + std::to_string(process) + " loads their scene");
  pollfd wanted{pipe, POLLIN, 0};
  char byte = 0;
  const auto deadline = std::chrono::steady_clock::now() + kReadyTimeout;
  while (true) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    if (left <= 0ms) return false;
    const int n = ::poll(&wanted, 1, static_cast<int>(std::min(left, kReadyLook).count()));
    if (StopOnSignal::requested()) return false;
    if (n == 0 || (n < 0 && errno == EINTR)) continue;
    return n == 1 && ::read(pipe, &byte, 1) == 1;
  }
}

constexpr const char* kRuntimePrefix = "tankrig-runtime-";
constexpr const char* kUnlocked = ".tankrig-runtime-";
constexpr std::time_t kLockedBy_s = 60;

/// Folders of killed processes: ours, and nobody holds their lock any more. One that may still get its lock is young.
void remove_orphans(const std::filesystem::path& place) {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(place, ignored)) {
    const std::string name = entry.path().filename().string();
    const bool unlocked = name.starts_with(kUnlocked);
    if (!unlocked && !name.starts_with(kRuntimePrefix)) continue;
    const int folder = ::open(entry.path().c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (folder < 0) continue;
    struct stat status {};
    if (::fstat(folder, &status) == 0 && status.st_uid == ::geteuid() &&
        !(unlocked && status.st_mtime > ::time(nullptr) - kLockedBy_s) && ::flock(folder, LOCK_EX | LOCK_NB) == 0)
      std::filesystem::remove_all(entry.path(), ignored);
    ::close(folder);
  }
}

}  // namespace

RuntimeFolder::RuntimeFolder() {
  const std::filesystem::path place = std::filesystem::temp_directory_path();
  remove_orphans(place);
  std::string name = (place / kUnlocked).string() + "XXXXXX";
  if (!::mkdtemp(name.data())) throw InputError(name + ": " + std::strerror(errno) + ", expected a folder to write in");
  path_ = place / (kRuntimePrefix + name.substr(name.size() - 6));
  // Locked before it has the name that others look for; the emulating process inherits the lock.
  lock_ = ::open(name.c_str(), O_RDONLY | O_DIRECTORY);
  if (lock_ < 0 || ::flock(lock_, LOCK_EX | LOCK_NB) != 0 || ::rename(name.c_str(), path_.c_str()) != 0) {
    const int problem = errno;
    if (lock_ >= 0) ::close(lock_);
    ::rmdir(name.c_str());
    throw InputError(path_, std::string(std::strerror(problem)) + ", expected a folder to write in");
  }
}

RuntimeFolder::~RuntimeFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
  ::close(lock_);
}

EmulationProcess::EmulationProcess(const RigConfig& rig, const BackendOptions& options) {
  int pipe[2];
  if (::pipe(pipe) != 0) throw InputError(std::string("emulated devices: pipe: ") + std::strerror(errno));
  std::vector<std::string> words = arguments(rig, options, runtime_.path(), pipe[1]);
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const pid_t parent = ::getpid();
  process_ = ::fork();
  if (process_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(1);
    ::setpgid(0, 0);
    ::close(pipe[0]);
    ::dup2(STDERR_FILENO, STDOUT_FILENO);
    ::execv("/proc/self/exe", argv.data());
    ::_exit(127);
  }
  ::close(pipe[1]);
  const bool ready = process_ > 0 && wait_ready(pipe[0], process_);
  ::close(pipe[0]);
  if (ready) return;
  if (process_ > 0) ::kill(process_, SIGKILL);  // nothing hangs on devices that nobody has used
  end();
  if (StopOnSignal::requested()) throw StoppedEarly("stopped while the emulated devices started: nothing moved");
  throw InputError(rig.file, "emulation: the emulated devices did not start");
}

void EmulationProcess::end() noexcept {
  if (process_ <= 0) return;
  ::kill(process_, SIGTERM);
  MonotonicClock clock;  // whose sleep ends in time however often a signal comes: a key may be held down
  const Stamp deadline = clock.now() + kEndTimeout;
  while (::waitpid(process_, nullptr, WNOHANG) == 0) {
    if (clock.now() > deadline) {
      ::kill(process_, SIGKILL);
      ::waitpid(process_, nullptr, 0);
      break;
    }
    clock.sleep_until(clock.now() + 10ms);
  }
  process_ = -1;
}

}  // namespace tankrig::app
