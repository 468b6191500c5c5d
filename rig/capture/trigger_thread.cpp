#include "rig/capture/trigger_thread.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "core/thread_priority.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kToldLater = 1024;  // fired triggers that wait for the supervisor
constexpr int kPriority = 75;             // below the cycle's, above everything that moves pictures

}  // namespace

TriggerThread::TriggerThread(Camera& camera, Clock& clock)
    : camera_(camera),
      clock_(clock),
      requests_(kWaiting),
      fired_(kToldLater),
      news_(::eventfd(0, EFD_SEMAPHORE | EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (news_ < 0) throw std::system_error(errno, std::generic_category(), "trigger thread: eventfd");
}

TriggerThread::~TriggerThread() {
  end();
  ::close(news_);
}

void TriggerThread::end() {
  ending_.store(true, std::memory_order_relaxed);
  ::eventfd_write(news_, 1);
  if (thread_.joinable()) thread_.join();
}

bool TriggerThread::request(const TriggerRequest& request) noexcept {
  if (!requests_.try_push(request)) return false;
  if (!clock_.real_time()) return true;
  life_.expect(request.fire_at);
  ::eventfd_write(news_, 1);
  return true;
}

void TriggerThread::begin() {
  if (clock_.real_time() && !thread_.joinable()) thread_ = std::thread([this] { run(); });
}

void TriggerThread::run() {
  set_fifo("tankrig-trigger", kPriority);
  try {
    while (true) {
      pollfd door{news_, POLLIN, 0};
      if (::poll(&door, 1, -1) < 0 && errno != EINTR)
        throw std::system_error(errno, std::generic_category(), "trigger thread: poll");
      eventfd_t one;
      if (::eventfd_read(news_, &one) != 0) continue;
      if (ending_.load(std::memory_order_relaxed)) return;
      TriggerRequest request;
      if (!requests_.try_pop(request)) continue;
      clock_.sleep_until(request.fire_at);
      fire(request);
    }
  } catch (...) {
    life_.end();
  }
}

std::optional<Stamp> TriggerThread::due() noexcept {
  TriggerRequest request;
  if (!next_ && requests_.try_pop(request)) next_ = request;
  return next_ ? std::optional(next_->fire_at) : std::nullopt;
}

void TriggerThread::fire_due() noexcept {
  if (!due()) return;
  clock_.sleep_until(next_->fire_at);
  try {
    fire(*next_);
  } catch (...) {
    life_.end();
  }
  next_.reset();
}

void TriggerThread::fire(const TriggerRequest& request) {
  FiredTrigger fired{request, clock_.now(), false, {}};
  life_.give(fired.fired);
  const Status done = camera_.trigger();
  life_.rest();
  fired.accepted = done.ok();
  if (!done.ok()) fired.error = done.error();
  (void)fired_.try_push(fired);  // full only if nobody has asked for the last thousand
}

}  // namespace tankrig
