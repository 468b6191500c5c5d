#include "sim_backends/wire/pty_server.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <utility>

#include "core/clock.hpp"
#include "core/input_error.hpp"

namespace tankrig::sim {
namespace {

constexpr Duration kLongestSleep = std::chrono::seconds{1};

}  // namespace

PtyServer::PtyServer(std::filesystem::path name, Receive receive, Tick tick)
    : receive_(std::move(receive)),
      tick_(std::move(tick)),
      pty_(std::move(name)),
      wake_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (wake_ < 0) throw InputError(pty_.name(), "emulated serial device: no eventfd");
  thread_ = std::thread([this] { run(); });
}

PtyServer::~PtyServer() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake();
  thread_.join();
  ::close(wake_);
}

void PtyServer::wake() noexcept {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(wake_, &one, sizeof one);
}

void PtyServer::answer(std::span<const std::uint8_t> bytes, Duration delay) {
  answers_.push_back({MonotonicClock{}.now() + delay, {bytes.begin(), bytes.end()}});
}

void PtyServer::set_plugged(bool plugged) {
  std::unique_lock lock(mutex_);
  wanted_plugged_ = plugged;
  wake();
  changed_.wait(lock, [&] { return plugged_ == plugged || stop_; });
}

void PtyServer::follow_plug() {
  const std::lock_guard lock(mutex_);
  if (wanted_plugged_ == plugged_) return;
  answers_.clear();
  if (wanted_plugged_)
    pty_.plug();
  else
    pty_.unplug();
  plugged_ = wanted_plugged_;
  changed_.notify_all();
}

Duration PtyServer::send_due() {
  while (!answers_.empty()) {
    const Duration left = answers_.front().due - MonotonicClock{}.now();
    if (left.count() > 0) return left;
    [[maybe_unused]] const auto sent = pty_.try_write(answers_.front().bytes);
    answers_.pop_front();
  }
  return kLongestSleep;
}

void PtyServer::run() {
  std::array<std::uint8_t, 512> bytes;
  for (;;) {
    {
      const std::lock_guard lock(mutex_);
      if (stop_) return;
    }
    follow_plug();
    for (;;) {
      const auto got = pty_.try_read(bytes);
      if (!got.ok() || got.value() == 0) break;
      receive_({bytes.data(), got.value()});
    }
    const Duration sleep = std::max(std::min(tick_(), send_due()), Duration{0});
    const timespec timeout{sleep.count() / 1'000'000'000, sleep.count() % 1'000'000'000};
    pollfd doors[2] = {{wake_, POLLIN, 0}, {pty_.descriptor(), POLLIN, 0}};
    if (::ppoll(doors, pty_.descriptor() >= 0 ? 2 : 1, &timeout, nullptr) > 0 && doors[0].revents) {
      std::uint64_t count = 0;
      [[maybe_unused]] const ssize_t taken = ::read(wake_, &count, sizeof count);
    }
  }
}

}  // namespace tankrig::sim
