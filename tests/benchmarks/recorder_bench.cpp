// The recorder in real time: two 1.3-megapixel cameras at 30 frames/s without a drop, beside what the disk can do.
#include <benchmark/benchmark.h>
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <opencv2/core.hpp>
#include <thread>

#include "session/recording/session_writer.hpp"
#include "tests/support/machine_witness.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr Duration kBearable = std::chrono::milliseconds{100};  // the recorder's ring holds half a second

double since(SteadyClock::time_point begin) {
  return std::chrono::duration<double>(SteadyClock::now() - begin).count();
}

struct Load {
  std::vector<std::string> cameras;
  int width, height, type;
  double rate_hz;
};

SessionInfo session_of(const Load& load) {
  SessionInfo info;
  for (const std::string& name : load.cameras) {
    CalibratedCamera camera;
    camera.name = name;
    camera.model.width = load.width, camera.model.height = load.height;
    camera.model.fx = camera.model.fy = 1000;
    info.cameras.push_back(camera);
  }
  return info;
}

/// Pictures with the noise of a sensor, each used again and again.
std::vector<cv::Mat> pictures_of(const Load& load) {
  std::vector<cv::Mat> pictures(8);
  cv::RNG random(7);
  for (cv::Mat& picture : pictures) {
    picture.create(load.height, load.width, load.type);
    random.fill(picture, cv::RNG::NORMAL, 90, 6);
  }
  return pictures;
}

/// 10 s of the load with 200 joint samples per second, then the pictures. A dropped frame is an error.
void record(benchmark::State& state, const Load& load) {
  constexpr double kSeconds = 10;
  const std::vector<cv::Mat> pictures = pictures_of(load);
  const double frame_mb = 1e-6 * static_cast<double>(pictures[0].total() * pictures[0].elemSize());
  const int frames = static_cast<int>(kSeconds * load.rate_hz);
  const int joints_per_frame = static_cast<int>(200 / load.rate_hz);
  for (auto _ : state) {
    const TemporaryFolder folder;
    SessionWriter writer(folder.path() / "s", session_of(load), {.wait_when_full = false});
    double longest_call = 0;
    const testing_support::MachineWitness witness;
    const auto begin = SteadyClock::now();
    for (int i = 0; i < frames; ++i) {
      std::this_thread::sleep_until(
          begin + std::chrono::duration_cast<SteadyClock::duration>(std::chrono::duration<double>(i / load.rate_hz)));
      const auto call = SteadyClock::now();
      for (int j = 0; j < joints_per_frame; ++j) writer.joints({});
      for (const std::string& camera : load.cameras) {
        FrameRecord frame;
        frame.camera = camera;
        frame.index = i;
        writer.frame(frame, pictures[static_cast<std::size_t>(i) % pictures.size()]);
      }
      longest_call = std::max(longest_call, since(call));
    }
    const double recorded_s = since(begin);
    const auto end = SteadyClock::now();
    writer.close("complete");
    const double pictures_s = since(end);
    std::uint64_t recorded = 0;
    for (const std::string& camera : load.cameras) recorded += writer.info().counts[camera + ".recorded"];
    const std::size_t offered = static_cast<std::size_t>(frames) * load.cameras.size();
    state.counters["MB_per_s"] = static_cast<double>(offered) * frame_mb / recorded_s;
    state.counters["dropped"] = static_cast<double>(offered - recorded);
    state.counters["longest_call_ms"] = 1e3 * longest_call;
    state.counters["pictures_per_s"] = static_cast<double>(recorded) / pictures_s;
    if (witness.latest() > kBearable)
      state.SkipWithError(testing_support::machine_was_late(witness.latest(), kBearable).c_str());
    else if (recorded != offered)
      state.SkipWithError("frames were dropped");
  }
}

void two_mono_1300k_30hz(benchmark::State& state) { record(state, {{"left", "right"}, 1280, 1024, CV_8UC1, 30}); }
void three_colour_vga_25hz(benchmark::State& state) {
  record(state, {{"mono", "left", "right"}, 640, 480, CV_8UC3, 25});
}

/// The same folder, written in one go and sent to the disk: what the recorder is measured against.
void disk_sequential_write(benchmark::State& state) {
  constexpr std::size_t kBlock = 4 << 20, kBlocks = 128;
  const std::string block(kBlock, 'x');
  for (auto _ : state) {
    const TemporaryFolder folder;
    const int file = ::open((folder.path() / "raw").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
    const auto begin = SteadyClock::now();
    bool written = file >= 0;
    for (std::size_t i = 0; i < kBlocks && written; ++i)
      written = ::write(file, block.data(), kBlock) == static_cast<ssize_t>(kBlock);
    written = written && ::fdatasync(file) == 0;
    state.counters["MB_per_s"] = 1e-6 * static_cast<double>(kBlock * kBlocks) / since(begin);
    ::close(file);
    if (!written) state.SkipWithError("the disk cannot be written");
  }
}

BENCHMARK(disk_sequential_write)->Iterations(1)->Unit(benchmark::kSecond)->UseRealTime();
BENCHMARK(two_mono_1300k_30hz)->Iterations(1)->Unit(benchmark::kSecond)->UseRealTime();
BENCHMARK(three_colour_vga_25hz)->Iterations(1)->Unit(benchmark::kSecond)->UseRealTime();

}  // namespace
}  // namespace tankrig
