// From one node's send to another's receive, beside bare sockets of the same kind in the same run; frames' bits; log
// lines.
#include <benchmark/benchmark.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <vector>

#include "drivers/can/can_log.hpp"
#include "drivers/can/can_socket.hpp"
#include "drivers/can/can_timing.hpp"
#include "drivers/can/owned_descriptor.hpp"

namespace tankrig {
namespace {

constexpr const char* kInterface = "vcan0";
/// Stamps, counts, filter and checks of ours against send() and recv() alone.
constexpr double kMostRatio = 2.0;

bool has_interface() {
  const OwnedDescriptor fd(::socket(PF_CAN, SOCK_RAW, CAN_RAW));
  return fd && ::if_nametoindex(kInterface) != 0;
}

/// Two sockets of the carrier's kind without anything of ours.
struct BarePair {
  OwnedDescriptor a, b;
  explicit BarePair(bool interface) {
    if (!interface) {
      int fds[2] = {-1, -1};
      if (::socketpair(AF_UNIX, SOCK_SEQPACKET, 0, fds) != 0) return;
      a = OwnedDescriptor(fds[0]);
      b = OwnedDescriptor(fds[1]);
      return;
    }
    for (OwnedDescriptor* fd : {&a, &b}) {
      *fd = OwnedDescriptor(::socket(PF_CAN, SOCK_RAW, CAN_RAW));
      sockaddr_can address{};
      address.can_family = AF_CAN;
      address.can_ifindex = static_cast<int>(::if_nametoindex(kInterface));
      if (::bind(fd->get(), reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) fd->reset();
    }
  }
};

template <class Action>
double nanoseconds_each(int times, const Clock& clock, Action action) {
  const Stamp begin = clock.now();
  for (int i = 0; i < times; ++i) action();
  return static_cast<double>((clock.now() - begin).count()) / times;
}

double median(std::vector<double>& values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

/// One frame at a time in one thread: what the kernel and we take, no scheduler between. Batches of both alternate, so
/// that a disturbed machine disturbs both.
void send_to_receive(benchmark::State& state, bool interface) {
  if (interface && !has_interface()) {
    state.SkipWithError("skipped: no vcan0 on this kernel");
    return;
  }
  constexpr int kBatch = 200;
  const MonotonicClock clock;
  CanSettings settings;
  settings.interface = kInterface;
  settings.filters = {{0x100, 0x7F0}};
  auto ends = interface ? std::pair{CanCarrier::open(settings), CanCarrier::open(settings)} : CanCarrier::pair();
  CanSocket a(std::move(ends.first), settings, clock), b(std::move(ends.second), settings, clock);
  CanFrame frame;
  frame.id = 0x105;
  frame.length = 8;
  std::uint64_t received = 0;
  std::vector<double> ours, bare;
  for (auto _ : state) {
    ours.push_back(nanoseconds_each(kBatch, clock, [&] {
      if (!a.try_send(frame).ok()) return;
      const auto f = b.try_receive();
      received += f.ok() && f.value();
    }));
    // Opened for each batch: on an interface the others' sockets would hear, too, and cost both their time.
    state.PauseTiming();
    {
      const BarePair pair(interface);
      can_frame raw{};
      raw.can_id = frame.id + 0x100;  // no business of our filter
      raw.can_dlc = 8;
      bare.push_back(nanoseconds_each(kBatch, clock, [&] {
        if (::send(pair.a.get(), &raw, sizeof raw, 0) != sizeof raw) return;
        benchmark::DoNotOptimize(::recv(pair.b.get(), &raw, sizeof raw, MSG_DONTWAIT));
      }));
    }
    state.ResumeTiming();
  }
  if (received != ours.size() * kBatch) state.SkipWithError("failed: frames were lost");
  const double us = median(ours), them = median(bare);
  state.counters["ours_ns"] = us;
  state.counters["bare_ns"] = them;
  state.counters["ratio"] = us / them;
  if (us > kMostRatio * them) state.SkipWithError("failed: more than twice a bare socket pair");
}
BENCHMARK_CAPTURE(send_to_receive, pair, false)->Iterations(2000)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(send_to_receive, vcan0, true)->Iterations(2000)->Unit(benchmark::kMicrosecond);

void count_frame_bits(benchmark::State& state) {
  can_frame frame{};
  frame.can_id = 0x123;
  frame.can_dlc = 8;
  for (auto _ : state) {
    ++frame.data[0];
    benchmark::DoNotOptimize(frame_bits(frame));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(count_frame_bits);

void write_and_read_log_line(benchmark::State& state) {
  CanLogEntry entry;
  entry.wall_ns = 1'700'000'000'123'456'000;
  entry.interface = "can0";
  entry.frame.can_id = 0x123;
  entry.frame.len = 8;
  std::string line;
  for (auto _ : state) {
    line.clear();
    append_line(entry, line);
    benchmark::DoNotOptimize(parse_can_log_line(line));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(write_and_read_log_line);

}  // namespace
}  // namespace tankrig
