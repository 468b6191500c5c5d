#include "tests/kernel/realtime/arm_process.hpp"

#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <stdexcept>

#include "core/clock.hpp"
#include "sim_backends/wire/arm_emulator.hpp"

namespace tankrig::test {
namespace {

template <class T>
bool put(int fd, const T& value) {
  return ::send(fd, &value, sizeof value, MSG_NOSIGNAL) == static_cast<ssize_t>(sizeof value);
}

template <class T>
bool get(int fd, T& value) {
  return ::recv(fd, &value, sizeof value, MSG_WAITALL) == static_cast<ssize_t>(sizeof value);
}

}  // namespace

ArmProcess::ArmProcess(const std::string& interface, const sim::ArmEmulatorParameters& parameters) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) throw std::runtime_error("no socket pair");
  line_ = OwnedDescriptor(ends[0]);
  pid_ = ::fork();
  if (pid_ == 0) {
    line_ = {};
    serve(ends[1], interface, parameters);
  }
  ::close(ends[1]);
  if (pid_ < 0 || !get(line_.get(), true_zero_)) throw std::runtime_error("no emulated arm on " + interface);
}

ArmProcess::~ArmProcess() {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
}

/// Answers every byte with the truth, until there is nobody to ask.
void ArmProcess::serve(int end, const std::string& interface, const sim::ArmEmulatorParameters& parameters) {
  try {
    MonotonicClock clock;
    CanSettings can;
    can.interface = interface;
    can.bitrate = parameters.can_bitrate;
    can.filters = parameters.can_ids.host_filters();
    sim::ArmEmulator arm(arm5e(), parameters, clock);
    arm.serve(open_can(can, clock));
    ::mlockall(MCL_CURRENT | MCL_FUTURE);
    put(end, arm.true_zero());
    for (char asked; get(end, asked);) put(end, arm.truth_at(clock.now()));
  } catch (...) {
  }
  ::_exit(0);
}

JointVector ArmProcess::truth() const {
  JointVector q;
  if (!put(line_.get(), '?') || !get(line_.get(), q)) throw std::runtime_error("the emulated arm has ended");
  return q;
}

}  // namespace tankrig::test
