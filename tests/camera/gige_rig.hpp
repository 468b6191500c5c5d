// Emulated GigE Vision cameras and what their tests share.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <mutex>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/clock.hpp"
#include "drivers/camera/aravis_camera.hpp"
#include "sim_backends/wire/gige_camera.hpp"
#include "sim_backends/wire/private_network.hpp"

namespace tankrig::testing {

/// Entered once per process, before the first camera and before main(): once there was a thread, only root can.
inline const Status& private_network() {
  static const Status entered = sim::enter_private_network(4);
  return entered;
}
inline const bool kEnteredFirst = private_network().ok();

/// A test on loopback cameras: in a network of its own, or skipped with the reason.
class GigeTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const Status& entered = private_network();
    if (!entered.ok()) GTEST_SKIP() << entered.error().where << " (errno " << entered.error().os_errno << ")";
  }
};

/// Picture number `index`: every pixel known, no two neighbours in time alike.
inline cv::Mat known_picture(std::uint64_t index, cv::Size size, int channels) {
  cv::Mat picture(size, CV_MAKETYPE(CV_8U, channels));
  const int row = size.width * channels;
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < row; ++x)
      picture.ptr(y)[x] =
          static_cast<std::uint8_t>(static_cast<std::uint64_t>(7 * x + 13 * y + (x * y >> 4)) + 31 * index);
  return picture;
}

/// The emulator's index of a frame that shows known_picture(index + `added`), of a camera that was started once: its
/// numbers begin with its first exposure.
inline std::uint64_t known_index(const Frame& frame, std::uint64_t added = 0) {
  constexpr std::uint64_t kInverse = 223;  // 31 * 223 = 1 (mod 256)
  EXPECT_EQ((frame.image.data[0] * kInverse - frame.sequence - added) & 0xFF, 0u) << "frame " << frame.sequence;
  return frame.sequence;
}

/// What the emulator exposed, by index.
class TruthLog {
 public:
  sim::GigeTruth writer() {
    return [this](std::uint64_t index, Stamp begin, Duration exposure) {
      const std::lock_guard lock(mutex_);
      middle_[index] = begin + exposure / 2;
    };
  }
  std::optional<Stamp> middle(std::uint64_t index) const {
    const std::lock_guard lock(mutex_);
    const auto found = middle_.find(index);
    return found == middle_.end() ? std::nullopt : std::optional(found->second);
  }
  std::size_t size() const {
    const std::lock_guard lock(mutex_);
    return middle_.size();
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::uint64_t, Stamp> middle_;
};

/// Looks until `found` or the deadline; what comes with a condition needs no fixed sleep.
inline bool wait_for(const std::function<bool()>& found, Duration patience = std::chrono::seconds(10)) {
  const MonotonicClock clock;
  const Stamp deadline = clock.now() + patience;
  while (!found()) {
    if (clock.now() > deadline) return false;
    MonotonicClock{}.sleep_until(clock.now() + std::chrono::milliseconds(1));
  }
  return true;
}

/// The next frame, or the first error, or nothing at the deadline.
inline Result<std::optional<Frame>> grab(Camera& camera, Duration patience = std::chrono::seconds(10)) {
  Result<std::optional<Frame>> result = std::optional<Frame>{};
  wait_for(
      [&] {
        result = camera.try_grab();
        return !result.ok() || result.value().has_value();
      },
      patience);
  return result;
}

/// Up to `count` frames; stops at the first error.
inline std::vector<Frame> grab_frames(Camera& camera, std::size_t count) {
  std::vector<Frame> frames;
  while (frames.size() < count) {
    Result<std::optional<Frame>> next = grab(camera);
    if (!next.ok()) ADD_FAILURE() << next.error().where;
    if (!next.ok() || !next.value()) break;
    frames.push_back(std::move(*next.value()));
  }
  return frames;
}

inline double statistic(const Camera& camera, const std::string& name) {
  for (const Statistic& s : camera.statistics())
    if (s.name == name) return s.value;
  ADD_FAILURE() << "no statistic " << name;
  return -1;
}

}  // namespace tankrig::testing
