#include "rig/capture/trigger_thread.hpp"

#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>
#include <stdexcept>

namespace tankrig {
namespace {

using namespace std::chrono_literals;

/// Counts its triggers, and holds one up until it is let go.
class HeldCamera final : public Camera {
 public:
  CameraInfo info() const override { return {"mono", 2, 2, 1, 25}; }
  Status start() override { return {}; }
  Result<std::optional<Frame>> try_grab() override { return std::optional<Frame>{}; }
  void stop() noexcept override {}
  CameraCounters counters() const override { return {}; }
  Status trigger() override {
    std::unique_lock lock(mutex_);
    if (breaks) throw std::runtime_error("broken");
    ++triggers_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return !held_; });
    return {};
  }

  bool wait_for_triggers(int count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, 20s, [&] { return triggers_ >= count; });
  }
  void hold(bool held) {
    const std::lock_guard lock(mutex_);
    held_ = held;
    changed_.notify_all();
  }
  bool breaks = false;

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool held_ = false;
  int triggers_ = 0;
};

bool popped_within(TriggerThread& sut, FiredTrigger& fired, Duration patience = 20s) {
  MonotonicClock clock;
  for (const Stamp deadline = clock.now() + patience; clock.now() < deadline; std::this_thread::yield())
    if (sut.try_pop(fired)) return true;
  return false;
}

TEST(TriggerThread, FiresNoEarlierThanItIsAskedTo) {
  HeldCamera camera;
  MonotonicClock clock;
  TriggerThread sut(camera, clock);
  sut.begin();
  const Stamp when = clock.now() + 20ms;
  ASSERT_TRUE(sut.request({when, when}));
  FiredTrigger fired;
  ASSERT_TRUE(popped_within(sut, fired));
  EXPECT_GE(fired.fired, when);
  EXPECT_TRUE(fired.accepted);
}

TEST(TriggerThread, DropsRequestsOfACameraThatHangsInsteadOfWaiting) {
  HeldCamera camera;
  MonotonicClock clock;
  TriggerThread sut(camera, clock);
  sut.begin();
  camera.hold(true);
  ASSERT_TRUE(sut.request({clock.now(), clock.now()}));
  ASSERT_TRUE(camera.wait_for_triggers(1));
  for (std::size_t i = 0; i < TriggerThread::kWaiting; ++i) EXPECT_TRUE(sut.request({clock.now(), clock.now()}));
  EXPECT_FALSE(sut.request({clock.now(), clock.now()}));
  camera.hold(false);
  EXPECT_TRUE(camera.wait_for_triggers(1 + static_cast<int>(TriggerThread::kWaiting)));
}

TEST(TriggerThread, SaysThatItDiedOfAnException) {
  HeldCamera camera;
  camera.breaks = true;
  MonotonicClock clock;
  TriggerThread sut(camera, clock);
  sut.begin();
  ASSERT_TRUE(sut.request({clock.now(), clock.now()}));
  for (const Stamp deadline = clock.now() + 20s; !sut.dead() && clock.now() < deadline;) std::this_thread::yield();
  EXPECT_TRUE(sut.dead());
}

TEST(TriggerThread, SaysThatItHangsInTheCamerasDriver) {
  HeldCamera camera;
  MonotonicClock clock;
  TriggerThread sut(camera, clock);
  sut.begin();
  camera.hold(true);
  ASSERT_TRUE(sut.request({clock.now(), clock.now()}));
  ASSERT_TRUE(camera.wait_for_triggers(1));
  const Stamp begin = clock.now();
  while (!sut.dead() && clock.now() < begin + 20s) std::this_thread::yield();
  EXPECT_TRUE(sut.dead());
  camera.hold(false);
  FiredTrigger fired;
  EXPECT_TRUE(popped_within(sut, fired));
}

TEST(TriggerThread, FiresInTheCallersTurnUnderAVirtualClock) {
  HeldCamera camera;
  VirtualClock clock;
  TriggerThread sut(camera, clock);
  sut.begin();
  EXPECT_FALSE(sut.due());
  ASSERT_TRUE(sut.request({{5'000'000}, {9'000'000}}));
  EXPECT_EQ(sut.due(), Stamp{5'000'000});
  sut.fire_due();
  EXPECT_EQ(clock.now(), Stamp{5'000'000});
  FiredTrigger fired;
  ASSERT_TRUE(sut.try_pop(fired));
  EXPECT_EQ(fired.fired, Stamp{5'000'000});
}

}  // namespace
}  // namespace tankrig
