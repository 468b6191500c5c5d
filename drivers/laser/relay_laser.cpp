#include "drivers/laser/relay_laser.hpp"

#include <fmt/format.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

Error thread_dead(Stamp when) noexcept {
  return {ErrorCode::kInternal, 0, when, "laser relay: its thread is dead or stuck"};
}

}  // namespace

RelayLaser::RelayLaser(const RelayLaserSettings& settings, const Clock& clock)
    : settings_(settings), clock_(clock), port_(settings.serial), wake_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (wake_ < 0) throw InputError(settings.serial.device, std::string("laser relay: eventfd: ") + std::strerror(errno));
  last_call_ns_ = now().ns;
  life_.give(now());
  thread_ = std::thread([this] { run(); });
  try {
    wait_until_open();
  } catch (...) {
    stop_ = true;
    wake();
    thread_.join();
    ::close(wake_);
    throw;
  }
}

RelayLaser::~RelayLaser() {
  command_.fetch_and(static_cast<std::uint8_t>(~kOn));
  stop_ = true;
  wake();
  thread_.join();
  ::close(wake_);
}

void RelayLaser::wait_until_open() {
  std::unique_lock lock(opening_mutex_);
  if (opening_.wait_for(lock, settings_.opening_timeout, [this] { return opened_; })) return;
  const RelayProtocol& p = settings_.protocol;
  if (off_echoed_)
    throw InputError(settings_.serial.device,
                     fmt::format("laser relay: switches, but gives no status to 0x{:02x}: correct `status_query`, or "
                                 "leave it out, with `interlock: wired`, if the box has none",
                                 *p.status_query));
  if (counts_.wrong_echoes > 0)
    throw InputError(settings_.serial.device,
                     fmt::format("laser relay: answers 0x{:02x} to off (0x{:02x}), expected an echo: correct "
                                 "`device`, `baud`, `off_byte`",
                                 wrong_byte_.load(), p.off_byte));
  throw InputError(settings_.serial.device,
                   fmt::format("laser relay: no answer to off (0x{:02x}) within {} ms: check its power and cable, then "
                               "`device`, `baud`, `off_byte`",
                               p.off_byte, settings_.opening_timeout / std::chrono::milliseconds{1}));
}

Status RelayLaser::set(bool on) noexcept {
  const Stamp called = now();
  last_call_ns_.store(called.ns, std::memory_order_relaxed);
  if (!on) {
    command_.fetch_and(static_cast<std::uint8_t>(~kOn));
    wake();
    return {};
  }
  std::uint8_t before = command_.load();
  if (life_.missing(called)) return thread_dead(called);
  do {
    if (!(before & kReady)) {
      const Reading& reading = published_.latest();
      const ErrorCode code = reading.trusted ? ErrorCode::kNotReady : reading.code;
      return Error{code, reading.os_errno, called, "laser relay: switch on"};
    }
  } while (!command_.compare_exchange_weak(before, static_cast<std::uint8_t>(before | kOn)));
  wake();
  return {};
}

void RelayLaser::last_resort() noexcept {
  dying_ = true;
  port_.write_regardless({&settings_.protocol.off_byte, 1});
}

Result<LaserState> RelayLaser::state() noexcept {
  const Stamp called = now();
  last_call_ns_.store(called.ns, std::memory_order_relaxed);
  if (life_.missing(called)) return thread_dead(called);
  const Reading& reading = published_.latest();
  if (!reading.trusted) return Error{reading.code, reading.os_errno, called, "laser relay: read state"};
  LaserState s;
  s.commanded = (command_.load() & kOn) != 0;
  s.powered = reading.powered;
  s.emitting = reading.powered && called - reading.changed >= settings_.warm_up;
  s.since = s.emitting ? reading.changed + settings_.warm_up : reading.changed;
  s.interlock_closed = reading.interlock_closed;
  return s;
}

std::optional<bool> RelayLaser::interlock_closed() const noexcept {
  const Loop loop = loop_;
  return loop == Loop::kUnknown ? std::nullopt : std::optional(loop == Loop::kClosed);
}

void RelayLaser::withhold_refreshes(bool withheld) noexcept {
  if (withheld) opened_after_ns_ = 0;
  withheld_ = withheld;
  wake();
}

std::optional<Duration> RelayLaser::opened_by_itself() const noexcept {
  const std::int64_t after = opened_after_ns_;
  return after == 0 ? std::nullopt : std::optional(Duration{after});
}

Statistics RelayLaser::statistics() const {
  const auto count = [](const auto& value) { return static_cast<double>(value.load()); };
  return {{"commands", count(counts_.commands)},
          {"refreshes", count(counts_.refreshes)},
          {"queries", count(counts_.queries)},
          {"echoes_missing", count(counts_.echoes_missing)},
          {"wrong_echoes", count(counts_.wrong_echoes)},
          {"late_answers", count(counts_.late_answers)},
          {"disconnects", count(counts_.disconnects)},
          {"reconnects", count(counts_.reconnects)},
          {"latched_off", count(counts_.latched_off)},
          {"caller_timeouts", count(counts_.caller_timeouts)},
          {"slowest_answer_ms", count(counts_.slowest_answer_ns) * 1e-6}};
}

void RelayLaser::wake() noexcept {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(wake_, &one, sizeof one);
}

}  // namespace tankrig
