// Two 1.3-megapixel GigE Vision cameras at 30 frames a second: what their receiver costs, and that nothing is lost.
#include <benchmark/benchmark.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "core/clock.hpp"
#include "core/input_error.hpp"
#include "drivers/camera/aravis_camera.hpp"
#include "sim_backends/wire/gige_camera.hpp"
#include "sim_backends/wire/private_network.hpp"

namespace tankrig {
namespace {

constexpr int kWidth = 1280, kHeight = 1024, kCameras = 2;
constexpr double kRate = 30, kSeconds = 8;
constexpr double kMostCpu = 0.40;  // of one core, both streams

/// The cameras' process tells what it could not expose in time, and learns when to end.
struct Shared {
  std::atomic<bool> ready{false}, stop{false};
  std::array<std::atomic<std::uint64_t>, kCameras> exposed{}, skipped{};
};

std::string address(int camera) { return "127.0.0." + std::to_string(camera + 1); }

[[noreturn]] void serve(Shared& shared) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  std::vector<cv::Mat> pictures;
  for (int i = 0; i < 4; ++i) {
    pictures.emplace_back(kHeight, kWidth, CV_8UC1);
    cv::randu(pictures.back(), 0, 256);
  }
  try {
    std::vector<std::unique_ptr<sim::GigeCameraEmulator>> cameras;
    for (int i = 0; i < kCameras; ++i) {
      sim::GigeCameraSettings settings;
      settings.address = address(i);
      settings.serial = "BENCH-" + std::to_string(i);
      settings.width = kWidth;
      settings.height = kHeight;
      settings.rate_hz = kRate;
      cameras.push_back(std::make_unique<sim::GigeCameraEmulator>(
          settings, [&pictures](std::uint64_t index, Stamp, Duration) { return pictures[index % pictures.size()]; }));
    }
    shared.ready = true;
    MonotonicClock clock;
    while (!shared.stop) {
      clock.sleep_until(clock.now() + std::chrono::milliseconds(20));
      for (int i = 0; i < kCameras; ++i) {
        shared.exposed[static_cast<std::size_t>(i)] = cameras[static_cast<std::size_t>(i)]->exposures();
        shared.skipped[static_cast<std::size_t>(i)] = cameras[static_cast<std::size_t>(i)]->skipped();
      }
    }
  } catch (const InputError&) {
  }
  ::_exit(0);
}

double cpu_s() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto s = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
  return s(usage.ru_utime) + s(usage.ru_stime);
}

struct Counts {
  std::uint64_t delivered = 0, lost = 0, incomplete = 0, overrun = 0;
};

/// Reads both cameras for a while, as a rig's frame thread does.
void read_for(std::vector<std::unique_ptr<AravisCamera>>& cameras, double duration_s) {
  MonotonicClock clock;
  const Stamp end = clock.now() + from_seconds(duration_s);
  while (clock.now() < end) {
    for (auto& c : cameras)
      while (true) {
        const auto frame = c->try_grab();
        if (!frame.ok() || !frame.value()) break;
        benchmark::DoNotOptimize(frame.value()->image.data[frame.value()->sequence % 1000]);
      }
    clock.sleep_until(clock.now() + std::chrono::milliseconds(2));
  }
}

Counts counts(const std::vector<std::unique_ptr<AravisCamera>>& cameras) {
  Counts sum;
  for (const auto& c : cameras) {
    const CameraCounters k = c->counters();
    sum.delivered += k.delivered;
    sum.lost += k.lost;
    sum.incomplete += k.incomplete;
    sum.overrun += k.overrun;
  }
  return sum;
}

void receive(benchmark::State& state, AravisSettings::Socket socket, int packet_size) {
  static const Status entered = sim::enter_private_network(kCameras);
  if (!entered.ok()) {
    state.SkipWithError((std::string("skipped: ") + entered.error().where).c_str());
    return;
  }
  auto* shared =
      new (::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)) Shared;
  const pid_t server = ::fork();
  if (server == 0) serve(*shared);
  MonotonicClock clock;
  for (const Stamp end = clock.now() + std::chrono::seconds(10); !shared->ready && clock.now() < end;)
    clock.sleep_until(clock.now() + std::chrono::milliseconds(5));
  const auto skipped = [&] { return shared->skipped[0] + shared->skipped[1]; };
  try {
    std::vector<std::unique_ptr<AravisCamera>> cameras;
    for (int i = 0; i < kCameras; ++i) {
      AravisSettings settings;
      settings.info = {"camera" + std::to_string(i), kWidth, kHeight, 1, kRate};
      settings.address = address(i);
      settings.packet_size = packet_size;
      settings.socket = socket;
      cameras.push_back(std::make_unique<AravisCamera>(settings));
    }
    for (auto& c : cameras)
      if (!c->start().ok()) state.SkipWithError("a camera does not start");
    read_for(cameras, 1);
    for (auto _ : state) {
      const Counts before = counts(cameras);
      const std::uint64_t skipped_before = skipped();
      const double cpu_before = cpu_s();
      const Stamp begin = clock.now();
      read_for(cameras, kSeconds);
      const double elapsed = seconds(clock.now() - begin), cpu = (cpu_s() - cpu_before) / elapsed;
      const Counts after = counts(cameras);
      clock.sleep_until(clock.now() + std::chrono::milliseconds(60));  // the cameras' process tells with a delay
      const std::uint64_t unmade = skipped() - skipped_before;
      const std::uint64_t lost = after.lost - before.lost;
      state.counters["receiver_cpu_%"] = 100 * cpu;
      state.counters["frames/s"] = static_cast<double>(after.delivered - before.delivered) / elapsed;
      state.counters["lost"] = static_cast<double>(lost);
      state.counters["not_exposed"] = static_cast<double>(unmade);
      state.counters["incomplete"] = static_cast<double>(after.incomplete - before.incomplete);
      state.counters["overrun"] = static_cast<double>(after.overrun - before.overrun);
      if (cpu > kMostCpu) state.SkipWithError("the receiver takes more than 40 % of a core");
      if (lost > unmade || after.incomplete > before.incomplete || after.overrun > before.overrun)
        state.SkipWithError("frames were lost on the wire or in the receiver");
      if (unmade > static_cast<std::uint64_t>(0.1 * kRate * kSeconds * kCameras))
        state.SkipWithError("the emulated cameras had no time for their rate");
    }
  } catch (const InputError& e) {
    state.SkipWithError(e.what());
  }
  shared->stop = true;
  ::waitpid(server, nullptr, 0);
  ::munmap(shared, sizeof(Shared));
}

void two_cameras_jumbo_packets(benchmark::State& state) { receive(state, AravisSettings::Socket::kAuto, 9000); }
void two_cameras_small_packets(benchmark::State& state) { receive(state, AravisSettings::Socket::kAuto, 1500); }

BENCHMARK(two_cameras_jumbo_packets)->Iterations(1)->UseRealTime()->Unit(benchmark::kSecond);
BENCHMARK(two_cameras_small_packets)->Iterations(1)->UseRealTime()->Unit(benchmark::kSecond);

}  // namespace
}  // namespace tankrig
