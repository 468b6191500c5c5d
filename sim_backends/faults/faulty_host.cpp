#include "sim_backends/faults/faulty_host.hpp"

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "core/input_error.hpp"

namespace tankrig::sim {

bool FaultyHost::interlock(bool closed) const noexcept {
  return closed && !active(FaultDevice::kInterlock, FaultKind::kOff) &&
         !script_.off_now(FaultDevice::kInterlock, clock_.now());
}

void FaultyHost::write(bool frame) {
  if (active(FaultDevice::kDisk, FaultKind::kDiskFull))
    throw InputError(std::string("session: ") + std::strerror(ENOSPC));
  if (active(FaultDevice::kDisk, FaultKind::kWriteError))
    throw InputError(std::string("session: ") + std::strerror(EIO));
  if (!frame) return;
  const Stamp now = clock_.now();
  if (const FaultSpec* slow = active(FaultDevice::kDisk, FaultKind::kSlow)) clock_.sleep_until(now + slow->delay);
  if (const FaultSpec* stuck = active(FaultDevice::kDisk, FaultKind::kStuck))
    clock_.sleep_until(now + script_.left(*stuck, now));
}

void FaultyHost::round() {
  if (active(FaultDevice::kSupervisor, FaultKind::kOff)) throw std::runtime_error("supervisor: died (fault plan)");
  const Stamp now = clock_.now();
  if (const FaultSpec* slow = active(FaultDevice::kSupervisor, FaultKind::kSlow)) clock_.sleep_until(now + slow->delay);
  if (const FaultSpec* stuck = active(FaultDevice::kSupervisor, FaultKind::kStuck))
    clock_.sleep_until(now + script_.left(*stuck, now));
}

}  // namespace tankrig::sim
