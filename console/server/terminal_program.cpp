#include "console/server/terminal_program.hpp"

#include <fcntl.h>
#include <pty.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>

#include "console/feed/feed_format.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr int kFeedDescriptor = 3;  // of the program
constexpr winsize kSize{.ws_row = 50, .ws_col = 160, .ws_xpixel = 0, .ws_ypixel = 0};

[[noreturn]] void refuse(const char* what) {
  throw InputError(std::string("console: ") + what + ": " + std::strerror(errno) + ", expected to start a command");
}

/// What whoever started the server ignores (a shell its background's Ctrl-C, nohup the hang-up), the program must hear.
void hear_all_signals() {
  for (int signal = 1; signal <= SIGRTMAX; ++signal) ::signal(signal, SIG_DFL);
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
}

void never_wait(int descriptor) { ::fcntl(descriptor, F_SETFL, ::fcntl(descriptor, F_GETFL) | O_NONBLOCK); }

}  // namespace

TerminalProgram::TerminalProgram(const std::vector<std::string>& command) {
  int sockets[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, sockets) != 0) refuse("socketpair");
  std::vector<char*> argv;
  for (const std::string& word : command) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  process_ = ::forkpty(&terminal_, nullptr, nullptr, &kSize);
  if (process_ == 0) {
    hear_all_signals();
    ::dup2(sockets[1], kFeedDescriptor);  // leaves it open in the program
    ::close_range(kFeedDescriptor + 1, ~0U, 0);
    ::setenv(kFeedVariable, std::to_string(kFeedDescriptor).c_str(), 1);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  ::close(sockets[1]);
  feed_ = sockets[0];
  if (process_ < 0) {
    ::close(feed_);
    refuse("forkpty");
  }
  ::fcntl(terminal_, F_SETFD, FD_CLOEXEC);
  never_wait(terminal_);
  never_wait(feed_);
  end_ = static_cast<int>(::syscall(SYS_pidfd_open, process_, 0));
  if (end_ < 0) {
    ::close(terminal_);
    ::close(feed_);
    ::waitpid(process_, nullptr, 0);
    refuse("pidfd_open");
  }
}

TerminalProgram::~TerminalProgram() {
  ::close(terminal_);
  ::close(feed_);
  ::close(end_);
  if (process_ > 0) ::waitpid(process_, nullptr, WNOHANG);
}

void TerminalProgram::type(std::string_view keys) noexcept {
  [[maybe_unused]] const ssize_t taken = ::write(terminal_, keys.data(), keys.size());
}

int TerminalProgram::exit_code() {
  int status = 0;
  if (process_ > 0 && ::waitpid(process_, &status, 0) == process_) process_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace tankrig
