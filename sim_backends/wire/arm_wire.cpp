#include "sim_backends/wire/arm_wire.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "sim_backends/wire/wire_priority.hpp"

namespace tankrig::sim {

ArmWire::ArmWire(ArmElectronics& electronics, const ArmEmulatorParameters& parameters, const Clock& clock)
    : electronics_(electronics),
      parameters_(parameters),
      clock_(clock),
      random_(parameters.seed + 1),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (wake_.get() < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
}

void ArmWire::start() {
  thread_ = std::thread([this] { run(); });
}

void ArmWire::end() {
  if (!thread_.joinable()) return;
  ends_ = true;
  ::eventfd_write(wake_.get(), 1);
  thread_.join();
}

void ArmWire::set_plugged(bool plugged) {
  plugged_ = plugged;
  ::eventfd_write(wake_.get(), 1);
}

void ArmWire::run() {
  set_fifo("arm-wire", kEmulatedWirePriority);
  while (!ends_) {
    const Stamp now = clock_.now();
    const Duration rest = std::clamp(attend(now) - clock_.now(), Duration{0}, kIdle);
    const timespec longest{0, static_cast<long>(rest.count())};
    pollfd waits[2]{{wake_.get(), POLLIN, 0}, {descriptor(), POLLIN, 0}};
    ::ppoll(waits, 2, &longest, nullptr);
    if ((waits[1].revents & (POLLHUP | POLLERR)) != 0 && (waits[1].revents & POLLIN) == 0)
      ::ppoll(waits, 1, &longest, nullptr);  // nothing will come from there for now
    eventfd_t ignored = 0;
    ::eventfd_read(wake_.get(), &ignored);
  }
}

}  // namespace tankrig::sim
