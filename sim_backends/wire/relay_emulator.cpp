#include "sim_backends/wire/relay_emulator.hpp"

#include <algorithm>
#include <utility>

#include "core/clock.hpp"
#include "core/settings_table.hpp"
#include "drivers/laser/relay_laser.hpp"

namespace tankrig::sim {

namespace {

const Setting<RelayEmulatorSettings> kRelayEmulatorRows[] = {
    {"watchdog_ms", &RelayEmulatorSettings::watchdog, ConfigRange(0, 60'000),
     "opens by itself when no on came for longer; 0: never"},
    {"answer_delay_ms", &RelayEmulatorSettings::answer_delay, ConfigRange(0, 10'000), "of every answer"},
};

}  // namespace

constinit const SettingsTable<RelayEmulatorSettings> kRelayEmulatorKeys{kRelayEmulatorRows};

RelayEmulatorSettings relay_emulator_settings_from(const ConfigNode& laser, const ConfigNode* emulation,
                                                   const std::filesystem::path& runtime) {
  const RelayLaserSettings driver = relay_laser_settings_from(laser, runtime);
  RelayEmulatorSettings s{.name = driver.serial.device, .protocol = driver.protocol};
  if (emulation) read_settings(*emulation, kRelayEmulatorKeys, s);
  return s;
}

RelayEmulator::RelayEmulator(RelayEmulatorSettings settings, MockLaser& laser)
    : settings_(std::move(settings)),
      laser_(laser),
      answer_delay_ns_(settings_.answer_delay.count()),
      server_(
          settings_.name, [this](std::span<const std::uint8_t> bytes) { receive(bytes); }, [this] { return tick(); }) {}

void RelayEmulator::set_interlock_closed(bool closed) noexcept {
  interlock_closed_ = closed;
  server_.wake();
}

void RelayEmulator::set_fed(bool fed) noexcept {
  fed_ = fed;
  server_.wake();
}

std::vector<std::uint8_t> RelayEmulator::take_received() {
  const std::lock_guard lock(mutex_);
  return std::exchange(received_, {});
}

void RelayEmulator::receive(std::span<const std::uint8_t> bytes) {
  {
    const std::lock_guard lock(mutex_);
    received_.insert(received_.end(), bytes.begin(), bytes.end());
  }
  const RelayProtocol& p = settings_.protocol;
  const std::int64_t came = MonotonicClock{}.now().ns;
  for (const std::uint8_t byte : bytes) {
    if (byte == p.on_byte) {
      off_since_ns_ = 0;
      if (first_on_ns_ == 0) first_on_ns_ = came;
    } else if (byte == p.off_byte && off_since_ns_ == 0) {
      off_since_ns_ = came;
    }
  }
  if (fault_ == RelayFault::kDead) return;
  for (const std::uint8_t byte : bytes) {
    if (byte == p.on_byte) last_on_ = MonotonicClock{}.now();
    if (byte == p.on_byte || byte == p.off_byte) {
      switch_relay(byte == p.on_byte);
      answer(byte);
    } else if (p.status_query && byte == *p.status_query) {
      answer(relay_status_byte({closed_, interlock_closed_}));
    }
  }
}

void RelayEmulator::switch_relay(bool on) {
  const bool was_closed = closed_;
  closed_ = on || (closed_ && welded_);
  if (was_closed && !closed_) opened_ns_ = MonotonicClock{}.now().ns;
  [[maybe_unused]] const Status switched = laser_.set(closed_ && interlock_closed_ && fed_);
}

void RelayEmulator::answer(std::uint8_t byte) {
  const RelayFault fault = fault_;
  if (fault == RelayFault::kSilent) return;
  const Duration delay{answer_delay_ns_};
  if (fault == RelayFault::kGarbage) {
    const std::uint8_t noise[] = {0x00, 0xff, 0x7e};
    server_.answer(noise, delay);
  }
  if (fault == RelayFault::kWrongEcho) byte = static_cast<std::uint8_t>(byte ^ 0xA4);
  server_.answer({&byte, 1}, delay);
}

Duration RelayEmulator::tick() {
  constexpr Duration kIdle = std::chrono::seconds{1};
  [[maybe_unused]] const Status switched = laser_.set(closed_ && interlock_closed_ && fed_);
  if (!closed_ || settings_.watchdog.count() == 0) return kIdle;
  const Duration left = last_on_ + settings_.watchdog - MonotonicClock{}.now();
  if (left.count() > 0) return left;
  switch_relay(false);
  if (closed_) return kIdle;
  ++watchdog_openings_;
  return kIdle;
}

}  // namespace tankrig::sim
