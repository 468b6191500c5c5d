#include "drivers/arm/arm_keeper.hpp"

#include <utility>

#include "core/thread_priority.hpp"

namespace tankrig {
namespace {

constexpr auto kKeeperPeriod = std::chrono::milliseconds(50);
constexpr int kKeeperPriority = 77;  // below the cycle's and the laser's: the light goes off first

}  // namespace

ArmKeeper::ArmKeeper(const Clock& clock, Round round) : clock_(clock), round_(std::move(round)) {
  (void)suspend_watch_.look(clock_.asleep());  // the first look: from here on it is seen
  life_.give(clock_.now());
  thread_ = std::thread([this] { run(); });
}

ArmKeeper::~ArmKeeper() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void ArmKeeper::run() try {
  set_fifo("arm-keeper", kKeeperPriority);
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, kKeeperPeriod, [this] { return ends_; })) {
    life_.give(clock_.now());
    round_(suspend_watch_.look(clock_.asleep()), life_);
  }
} catch (...) {
  life_.end();
}

}  // namespace tankrig
