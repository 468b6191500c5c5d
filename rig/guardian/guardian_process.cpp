#include "rig/guardian/guardian_process.hpp"

#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/clock.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr int kReady_ms = 60'000;                   // its program is loaded from a disk that may be slow
constexpr Duration kEnd = std::chrono::seconds{2};  // it has nothing to do any more
constexpr Duration kEndLook = std::chrono::milliseconds{2};

/// A child with every signal blocked, and these two descriptors besides the first three.
int spawn(pid_t& process, std::vector<std::string>& words, int control, int memory) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_t files;
  ::posix_spawnattr_init(&attributes);
  ::posix_spawn_file_actions_init(&files);
  sigset_t all;
  ::sigfillset(&all);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSID);
  ::posix_spawnattr_setsigmask(&attributes, &all);
  ::posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_adddup2(&files, STDERR_FILENO, STDOUT_FILENO);
  for (const int kept : {control, memory}) ::posix_spawn_file_actions_adddup2(&files, kept, kept);
  const int problem = ::posix_spawn(&process, "/proc/self/exe", &files, &attributes, argv.data(), environ);
  ::posix_spawn_file_actions_destroy(&files);
  ::posix_spawnattr_destroy(&attributes);
  return problem;
}

}  // namespace

GuardianProcess::GuardianProcess(std::vector<std::string> arguments) {
  int pair[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair) != 0)
    throw InputError(std::string("guardian: socket pair: ") + std::strerror(errno));
  control_ = OwnedDescriptor(pair[0]);
  const OwnedDescriptor its(pair[1]);
  arguments.insert(arguments.begin(), "tankrig");
  arguments.insert(arguments.end(),
                   {"--control", std::to_string(its.get()), "--memory", std::to_string(memory_.descriptor())});
  if (const int problem = spawn(process_, arguments, its.get(), memory_.descriptor()))
    throw InputError(std::string("guardian: not started: ") + std::strerror(problem));
}

GuardianProcess::~GuardianProcess() {
  const bool orderly = !memory_.words().watched && !memory_.words().taken_over;
  control_.reset();
  MonotonicClock clock;
  for (const Stamp end = clock.now() + kEnd; orderly && clock.now() < end;) {
    if (::waitpid(process_, nullptr, WNOHANG) != 0) return;
    clock.sleep_until(clock.now() + kEndLook);
  }
}

std::function<void(int)> GuardianProcess::line(GuardianLine which) const {
  return [this, which](int line) {
    auto byte = static_cast<std::uint8_t>(which);
    iovec part{&byte, 1};
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))]{};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control;
    message.msg_controllen = sizeof control;
    cmsghdr* const c = CMSG_FIRSTHDR(&message);
    c->cmsg_level = SOL_SOCKET;
    c->cmsg_type = SCM_RIGHTS;
    c->cmsg_len = CMSG_LEN(sizeof line);
    std::memcpy(CMSG_DATA(c), &line, sizeof line);
    // One that has died is missed anyway.
    (void)!::sendmsg(control_.get(), &message, MSG_NOSIGNAL | MSG_DONTWAIT);
  };
}

void GuardianProcess::wait_until_ready() {
  pollfd door{control_.get(), POLLIN, 0};
  int ready = 0;
  while ((ready = ::poll(&door, 1, kReady_ms)) < 0 && errno == EINTR) {
  }
  char byte = 0;
  if (ready == 1 && ::recv(control_.get(), &byte, 1, MSG_DONTWAIT) == 1) return;
  throw InputError(ready == 0 ? "guardian: does not answer, expected it ready within 60 s: nothing may move without it"
                              : "guardian: ended before it was ready: nothing may move without it");
}

void GuardianProcess::begin(Duration patience) noexcept {
  memory_.words().patience_ns = patience.count();
  released_ = false;
}

const char* GuardianProcess::objection(Stamp now) noexcept {
  if (objection_) return objection_;
  const GuardianWords& words = memory_.words();
  silence_.look(now, words.rounds.load(std::memory_order_relaxed));
  if (words.taken_over)
    objection_ = "guardian: it has taken over laser and arm";
  else if (silence_.stalled_for() > kMissed)
    objection_ = "guardian: it does not watch any more";
  return objection_;
}

void GuardianProcess::completed(const OutputRight& /*right*/) noexcept {
  GuardianWords& words = memory_.words();
  words.steps.fetch_add(1);
  if (released_) return;
  words.watched = true;
  if (released_) words.watched = false;  // meanwhile
}

void GuardianProcess::release() noexcept {
  released_ = true;
  memory_.words().watched = false;
}

}  // namespace tankrig
