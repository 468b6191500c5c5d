#include "rig/guardian/guardian.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/clock.hpp"
#include "core/input_error.hpp"
#include "core/locked_memory.hpp"
#include "core/thread_priority.hpp"
#include "drivers/arm/can_arm_link.hpp"
#include "drivers/arm/serial_arm_link.hpp"
#include "rig/guardian/arm_rest.hpp"
#include "rig/guardian/guardian_memory.hpp"
#include "rig/guardian/guardian_report.hpp"
#include "rig/guardian/guardian_step.hpp"
#include "rig/guardian/out_of_reach.hpp"
#include "rig/guardian/relay_off.hpp"

namespace tankrig {
namespace {

constexpr std::chrono::milliseconds kRound{5};
constexpr Duration kAsk = std::chrono::milliseconds{20};        // until both confirm
constexpr Duration kAskAgain = std::chrono::milliseconds{200};  // afterwards, while the program is there
constexpr Duration kStart = std::chrono::seconds{60};           // a device of the program takes its time to open

/// The arm's serial line, which comes from the program.
SerialPort taken_line(const SerialSettings& settings) { return SerialPort(settings, -1); }

class Guardian {
 public:
  Guardian(const GuardianSettings& settings, OwnedDescriptor control, OwnedDescriptor memory)
      : settings_(settings),
        control_(std::move(control)),
        memory_(std::move(memory)),
        laser_(settings.laser_line, settings.laser) {
    if (::getsockopt(control_.get(), SOL_SOCKET, SO_PEERCRED, &program_, &size_) != 0)
      throw InputError(std::string("guardian: control socket: ") + std::strerror(errno));
  }

  /// Waits for the lines. False: the program has ended before.
  bool begin() {
    const bool serial = settings_.arm.carrier == ArmCarrier::kSerial;
    for (const Stamp end = clock_.now() + kStart; !has_laser_ || (serial && !has_arm_);) {
      if (clock_.now() > end) throw InputError("guardian: no lines from the program, expected them within 60 s");
      wait();
      take_news();
      if (gone_) return false;
    }
    if (!serial)
      make_arm(std::make_unique<CanArmLink>(open_can(settings_.arm.can, clock_), settings_.arm.can_ids,
                                            settings_.arm.can.bitrate, settings_.arm.encoder_latency));
    report_.emplace(deeds_, settings_.report, settings_.command, program_.pid);
    listen(clock_.now());
    const char ready = 'r';
    if (::send(control_.get(), &ready, 1, MSG_NOSIGNAL) != 1) gone_ = true;
    return true;
  }

  /// From here on nothing is allocated.
  int run() {
    while (true) {
      wait();
      take_news();
      const Stamp now = clock_.now();
      GuardianWords& words = memory_.words();
      words.rounds.fetch_add(1, std::memory_order_relaxed);
      listen(now);
      if (state_.taken_over) {
        note(deeds_.dark_ns, laser_.dark(), now);
        note(deeds_.rests_ns, arm_->rests(now), now);
      }
      const GuardianInputs in{now,
                              words.steps.load(),
                              words.watched.load(),
                              gone_,
                              laser_.dark() && arm_->rests(now),
                              acknowledged_ || out_of_reach(),
                              Duration{words.patience_ns.load()}};
      const GuardianStep next = step(state_, in);
      const bool begins = next.state.taken_over && !state_.taken_over;
      state_ = next.state;
      if (begins) take_over(now);
      if (next.act == GuardianAct::kEnd) return end();
      if (next.act == GuardianAct::kMakeSafe) make_safe(now);
    }
  }

 private:
  void wait() noexcept {
    pollfd door{control_.get(), static_cast<short>(gone_ ? 0 : POLLIN), 0};
    if (gone_) door.fd = -1;  // it would wake us for ever
    (void)::poll(&door, 1, static_cast<int>(kRound.count()));
    siginfo_t info;
    sigset_t said;
    sigemptyset(&said);
    sigaddset(&said, SIGUSR1);
    const timespec at_once{};
    if (::sigtimedwait(&said, &info, &at_once) == SIGUSR1) acknowledged_ = state_.taken_over;
  }

  /// Lines that the program has opened, or its end.
  void take_news() noexcept {
    while (!gone_) {
      std::uint8_t which = 0;
      iovec part{&which, 1};
      alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))];
      msghdr message{};
      message.msg_iov = &part;
      message.msg_iovlen = 1;
      message.msg_control = control;
      message.msg_controllen = sizeof control;
      const ssize_t got = ::recvmsg(control_.get(), &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0 && errno == EAGAIN) return;
      if (got <= 0) {
        gone_ = true;
        return;
      }
      const cmsghdr* c = CMSG_FIRSTHDR(&message);
      if (!c || c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_RIGHTS) continue;
      int line = -1;
      std::memcpy(&line, CMSG_DATA(c), sizeof line);
      take_line(static_cast<GuardianLine>(which), line);
      ::close(line);
    }
  }

  void take_line(GuardianLine which, int line) noexcept {
    if (which == GuardianLine::kLaser) {
      laser_.take(line);
      has_laser_ = true;
    } else if (arm_line_) {
      arm_line_->take(line);
    } else {
      SerialPort port = taken_line(settings_.arm.serial);
      port.take(line);
      auto link = std::make_unique<SerialArmLink>(std::move(port), settings_.arm.encoder_latency);
      arm_line_ = link.get();
      make_arm(std::move(link));
      has_arm_ = true;
    }
  }

  void make_arm(std::unique_ptr<ArmLink> link) { arm_.emplace(std::move(link), settings_.arm); }

  void listen(Stamp now) noexcept {
    if (state_.taken_over) laser_.listen();  // else its answers are the program's
    if (!state_.taken_over && arm_line_) return;
    arm_->listen(now);
  }

  void take_over(Stamp now) noexcept {
    memory_.words().taken_over = true;
    laser_.restart();
    arm_->restart();
    deeds_.gone = gone_;
    deeds_.stalled_ns = state_.stalled.count();
    deeds_.taken_over_ns = now.ns;
    ask_at_ = now;
  }

  void make_safe(Stamp now) noexcept {
    if (now >= ask_at_) {
      laser_.ask();  // the light first
      arm_->ask(now);
      const bool safe = laser_.dark() && arm_->rests(now);
      ask_at_ = now + (safe ? kAskAgain : kAsk);
    }
    if (told_ || now.ns == deeds_.taken_over_ns) return;
    told_ = true;
    report_->tell();  // once both have been asked
  }

  void note(std::atomic<std::int64_t>& since, bool is_so, Stamp now) noexcept {
    if (is_so == (since != 0)) return;
    since = is_so ? now.ns : 0;
    report_->tell();
  }

  /// Devices were emulated by the program, which has ended, and so have those that have not confirmed.
  bool out_of_reach() const noexcept {
    return settings_.emulated && gone_ && (laser_.lost() || laser_.dark()) &&
           (arm_->lost() || arm_->rests(clock_.now())) && (laser_.lost() || arm_->lost());
  }

  int end() noexcept {
    const bool confirmed = deeds_.dark_ns != 0 && deeds_.rests_ns != 0;
    deeds_.acknowledged = acknowledged_;
    deeds_.devices_ended = out_of_reach();
    deeds_.ended = true;
    report_->tell();
    return !state_.taken_over ? 0 : confirmed ? 3 : 1;
  }

  const GuardianSettings& settings_;
  const OwnedDescriptor control_;
  ucred program_{};
  socklen_t size_ = sizeof program_;
  GuardianMemory memory_;
  MonotonicClock clock_;
  GuardianDeeds deeds_;
  std::optional<GuardianReport> report_;  // outlives the lines: its lock says that they are taken
  RelayOff laser_;
  SerialArmLink* arm_line_ = nullptr;
  std::optional<ArmRest> arm_;
  bool has_laser_ = false, has_arm_ = false, gone_ = false, acknowledged_ = false, told_ = false;
  GuardianState state_;
  Stamp ask_at_{};
};

/// Signals are asked for; but those of a crash end it.
void block_signals() noexcept {
  sigset_t all;
  ::sigfillset(&all);
  for (const int crash : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP}) ::sigdelset(&all, crash);
  ::pthread_sigmask(SIG_SETMASK, &all, nullptr);
}

}  // namespace

int run_guardian(const GuardianSettings& settings, OwnedDescriptor control, OwnedDescriptor memory) {
  block_signals();
  ::prctl(PR_SET_NAME, "tankrig-guard");
  leave_the_cgroup();
  spare_from_out_of_memory();
  Guardian guardian(settings, std::move(control), std::move(memory));
  if (!guardian.begin()) return 0;
  const LockedMemory locked;
  touch_stack();
  set_fifo("guardian", settings.priority);
  const int code = guardian.run();
  set_ordinary();  // unlocking its memory and giving it back holds a processor for tens of milliseconds
  return code;
}

}  // namespace tankrig
