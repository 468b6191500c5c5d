#include "sim_backends/wire/box_emulator.hpp"

#include <algorithm>
#include <utility>

#include "core/clock.hpp"
#include "core/settings_table.hpp"
#include "sim_backends/wire/wire_priority.hpp"

namespace tankrig::sim {
namespace {

constexpr Duration kLook = std::chrono::milliseconds(2), kReply = std::chrono::milliseconds(20);

const Setting<BoxEmulatorSettings> kBoxEmulatorRows[] = {
    {"drop_out_ms", &BoxEmulatorSettings::drop_out, ConfigRange(0, 50), "of a contactor"},
    {"reset_after_ms", &BoxEmulatorSettings::reset_after, ConfigRange(0, 60'000),
     "somebody presses its button so long after it can be reset"},
    {"nobody_there", &BoxEmulatorSettings::nobody_there, "nobody does"},
};

}  // namespace

constinit const SettingsTable<BoxEmulatorSettings> kBoxEmulatorKeys{kBoxEmulatorRows};

BoxEmulator::BoxEmulator(BoxEmulatorSettings settings, std::function<void(bool)> contactors)
    : settings_(std::move(settings)),
      contactors_(std::move(contactors)),
      server_(
          settings_.name, [this](std::span<const std::uint8_t> bytes) { receive(bytes); }, [this] { return tick(); }) {}

/// A frame is an edge if it is the next one: one that is repeated says that its sender hangs.
void BoxEmulator::receive(std::span<const std::uint8_t> bytes) {
  const Stamp now = MonotonicClock::one().now();
  for (const std::uint8_t byte : bytes) {
    const auto message = reader_.take(byte);
    if (!message || message->value != 0) continue;
    const bool next = !beat_ || message->beat == static_cast<std::uint8_t>(*beat_ + 1);
    beat_ = message->beat;
    if (!next) continue;
    logic_.edge(now, true);
    ++edges_;
    last_edge_ns_ = now.ns;
    reply();
  }
}

Duration BoxEmulator::tick() {
  if (!std::exchange(real_time_, true)) set_fifo("emulated-box", kEmulatedWirePriority);
  const Stamp now = MonotonicClock::one().now();
  logic_.stop(stop_pressed_, now);
  logic_.tick(closed_, now);
  stuck_ = logic_.stuck();
  press_button(now);
  move_contactors(now);
  if (now >= reply_at_) {
    reply_at_ = now + kReply;
    reply();
  }
  return kLook;
}

void BoxEmulator::press_button(Stamp now) {
  const bool can_be_reset = logic_.ready() && !logic_.coil() && !stop_pressed_;
  if (!can_be_reset) ready_since_.reset();
  if (can_be_reset && !ready_since_) ready_since_ = now;
  logic_.button(!settings_.nobody_there && ready_since_ && now - *ready_since_ >= settings_.reset_after, now);
}

void BoxEmulator::move_contactors(Stamp now) {
  if (logic_.coil()) dropping_since_.reset();
  if (logic_.coil() == closed_ || welded_) return;
  if (logic_.coil()) {
    closed_ = true;
    contactors_(true);
    return;
  }
  if (!dropping_since_) dropping_since_ = now;
  if (now - *dropping_since_ < settings_.drop_out) return;
  dropping_since_.reset();
  closed_ = false;
  opened_ns_ = now.ns;
  contactors_(false);
}

void BoxEmulator::reply() {
  const bool enabled = logic_.coil() && closed_;
  const auto state = static_cast<std::uint8_t>((enabled ? kBoxEnabled : 0) | (logic_.ready() ? kBoxBeatsSeen : 0) |
                                               (logic_.stuck() ? kBoxContactStuck : 0));
  server_.answer(encode_box(kReplyLead, {state, beat_.value_or(0)}));
}

}  // namespace tankrig::sim
