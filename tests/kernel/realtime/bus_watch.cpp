#include "tests/kernel/realtime/bus_watch.hpp"

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <thread>

#include "drivers/can/open_can.hpp"
#include "tests/kernel/guest.hpp"

namespace tankrig::test {
namespace {

std::uint64_t frames_sent(const std::string& interface) {
  std::ifstream file("/sys/class/net/" + interface + "/statistics/tx_packets");
  std::uint64_t frames = 0;
  if (!(file >> frames)) throw std::runtime_error("no count of frames on " + interface);
  return frames;
}

bool holds(const std::array<std::uint16_t, kJoints>& ids, std::uint16_t id) {
  return std::find(ids.begin(), ids.end(), id) != ids.end();
}

}  // namespace

BusWatch::BusWatch(const std::string& interface, int bitrate, const ArmCanIds& ids, std::size_t cycles,
                   const Clock& clock)
    : ids_(ids), frames_(cycles) {
  CanSettings settings;
  settings.interface = interface;
  settings.bitrate = bitrate;
  bus_ = open_can(settings, clock);
}

void BusWatch::cycle(const CycleRecord& record) noexcept {
  take(record.cycle);
  begun_ = record.cycle + 1;
}

/// In `cycle`, or after it and before the next.
void BusWatch::take(std::size_t cycle) noexcept {
  for (;;) {
    const auto received = bus_->try_receive();
    if (!received.ok() || !received.value()) return;
    const std::uint16_t id = received.value()->id;
    const bool request = test::holds(ids_.demand, id) || test::holds(ids_.pid, id);
    const std::size_t of = request ? cycle : cycle - 1;
    if (of < frames_.size())
      ++frames_[of];
    else
      ++uncounted_;
  }
}

FrameHistogram BusWatch::frames_a_cycle() const {
  FrameHistogram cycles{};
  for (std::size_t i = 0; i < std::min(begun_, frames_.size()); ++i)
    ++cycles[std::min<std::size_t>(frames_[i], cycles.size() - 1)];
  return cycles;
}

std::uint64_t BusWatch::lost() const noexcept { return uncounted_ + bus_->counters().receive_dropped; }

std::uint64_t frames_once_silent(const std::string& interface) {
  std::uint64_t frames = frames_sent(interface);
  const bool silent = becomes_true([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const std::uint64_t before = frames;
    frames = frames_sent(interface);
    return frames == before;
  });
  if (!silent) throw std::runtime_error(interface + " never falls silent");
  return frames;
}

}  // namespace tankrig::test
