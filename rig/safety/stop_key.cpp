#include "rig/safety/stop_key.hpp"

#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string_view>

namespace tankrig {
namespace {

using namespace std::chrono_literals;

constexpr std::string_view kKeys = " \n\rqQ\x1b\x04", kKeysOfHold = "qQ\x1b\x04";

// What restore() needs, where a signal handler finds it.
termios own_mode;
std::atomic<int> changed{-1};  // the terminal whose mode is not its own
static_assert(std::atomic<int>::is_always_lock_free);

}  // namespace

StopKey::StopKey(int descriptor, std::atomic<bool>& stop, const std::optional<HeldKey>& hold_to_run)
    : descriptor_(descriptor), stop_(stop), hold_to_run_(hold_to_run) {
  if (::isatty(descriptor) == 0 || ::tcgetpgrp(descriptor) != ::getpgrp()) return;
  if (::tcgetattr(descriptor, &own_mode) != 0) return;
  wake_ = ::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (wake_ < 0) return;
  termios by_key = own_mode;
  by_key.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  by_key.c_cc[VMIN] = 1;
  by_key.c_cc[VTIME] = 0;
  changed = descriptor;
  (void)::tcsetattr(descriptor, TCSANOW, &by_key);
  sigset_t others, before;  // signals are for the program's other threads, but those of a crash of its own
  ::sigfillset(&others);
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP}) ::sigdelset(&others, signal);
  ::pthread_sigmask(SIG_SETMASK, &others, &before);
  try {
    thread_ = std::thread([this] { run(); });
  } catch (...) {
    ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
    restore();
    ::close(wake_);
    throw;
  }
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

StopKey::~StopKey() {
  if (!thread_.joinable()) return;
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(wake_, &one, sizeof one);
  thread_.join();
  ::close(wake_);
  restore();
}

void StopKey::run() noexcept {
  ::pthread_setname_np(::pthread_self(), "stop-key");
  pollfd doors[2] = {{wake_, POLLIN, 0}, {descriptor_, POLLIN, 0}};
  const std::string_view keys_that_stop = hold_to_run_ ? kKeysOfHold : kKeys;
  int presses = 0;
  while (true) {
    int longest_ms = -1;
    if (presses > 0) longest_ms = static_cast<int>((presses == 1 ? hold_to_run_->first : hold_to_run_->next) / 1ms);
    const int ready = ::poll(doors, 2, longest_ms);
    if (ready < 0 && errno != EINTR) break;
    if (ready == 0) break;  // it has been let go
    if (doors[0].revents != 0) return;
    if (doors[1].revents == 0) continue;
    std::array<char, 64> keys;
    const ssize_t got = ::read(descriptor_, keys.data(), keys.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    if (std::string_view(keys.data(), static_cast<std::size_t>(got)).find_first_of(keys_that_stop) !=
        std::string_view::npos)
      stop_.store(true);
    if (!hold_to_run_) continue;
    presses = presses == 0 ? 1 : 2;
    held_ = true;
  }
  stop_.store(true);  // the terminal has gone, or the key was let go
}

void StopKey::restore() noexcept {
  const int descriptor = changed.exchange(-1);
  if (descriptor >= 0) (void)::tcsetattr(descriptor, TCSANOW, &own_mode);
}

}  // namespace tankrig
