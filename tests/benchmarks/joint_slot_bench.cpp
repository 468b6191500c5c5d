// The joint slots' codec on one core: encode and decode, both directions of the wire, and the whole serial frame.
#include <benchmark/benchmark.h>
#include <time.h>

#include <random>
#include <vector>

#include "drivers/arm/joint_slot.hpp"
#include "drivers/arm/serial_frame.hpp"
#include "tests/support/counting_new.hpp"

namespace tankrig {
namespace {

constexpr double kRequiredRate = 20e6;  // slots/s encoded and decoded
constexpr std::size_t kSlots = 4096;
constexpr int kIterations = 10'000;
constexpr unsigned kSeed = 1;

/// Time this thread has had a core to itself.
double core_seconds() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Each iteration takes every slot through `code`, which encodes and decodes one.
template <class Slot, class Code>
void run(benchmark::State& state, const std::vector<Slot>& slots, Code code) {
  std::vector<Slot> out(slots.size());
  const std::uint64_t before = testing_support::allocations();
  const double begin = core_seconds();
  for (auto _ : state) {
    for (std::size_t i = 0; i < slots.size(); ++i) out[i] = code(slots[i]);
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
  }
  const double elapsed = core_seconds() - begin;
  const std::uint64_t allocated = testing_support::allocations() - before;
  const auto count = static_cast<double>(state.iterations()) * static_cast<double>(slots.size());
  state.SetItemsProcessed(static_cast<std::int64_t>(count));
  if (out != slots) state.SkipWithError("a slot did not come back as it went");
  if (allocated != 0) state.SkipWithError("memory was allocated");
  if (count / elapsed < kRequiredRate) state.SkipWithError("slower than 20 million slots a second");
}

/// Bytes between encoding and decoding go through memory, as on a wire.
SlotBytes through_memory(SlotBytes bytes) {
  benchmark::DoNotOptimize(bytes);
  return bytes;
}

void demand(benchmark::State& state) {
  std::mt19937 random(kSeed);
  std::vector<DemandSlot> slots(kSlots);
  for (DemandSlot& s : slots)
    s = {static_cast<DemandType>(random() % 7), sendable(static_cast<std::uint16_t>(random() & 0xFFF)),
         static_cast<std::uint16_t>(random() & 0xFFF), static_cast<std::uint16_t>(random() & 0xFFF)};
  run(state, slots, [](const DemandSlot& s) { return decode_demand(through_memory(encode(s))); });
}
BENCHMARK(demand)->Iterations(kIterations);

void sensors(benchmark::State& state) {
  std::mt19937 random(kSeed);
  std::vector<SensorSlot> slots(kSlots);
  for (SensorSlot& s : slots)
    s = {static_cast<std::uint16_t>(random()), static_cast<std::uint16_t>(random()),
         static_cast<std::uint8_t>(random()), static_cast<std::uint8_t>(random()),
         static_cast<std::uint16_t>(random())};
  run(state, slots, [](const SensorSlot& s) { return decode_sensors(through_memory(encode(s))); });
}
BENCHMARK(sensors)->Iterations(kIterations);

/// For comparison: a whole 51-byte frame, found byte by byte in the stream.
void serial_frame(benchmark::State& state) {
  SerialContent content;
  for (SerialSlot& slot : content.slots) slot = {1, encode(SensorSlot{0x1234, 500, 0, 14, 0})};
  SerialDecoder decoder;
  for (auto _ : state) {
    content.master[0] = static_cast<std::uint8_t>(content.master[0] + 1);
    for (const std::uint8_t byte : encode(content)) decoder.push(byte);
    benchmark::DoNotOptimize(decoder.content());
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(serial_frame);

}  // namespace
}  // namespace tankrig
