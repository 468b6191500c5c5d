// The account of a scan's frames closes whatever becomes of them, and tells where it does not.
#include "session/reading/frame_account.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <random>

#include "sim_backends/faults/faulty_camera.hpp"
#include "tests/support/mock_rig.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

/// A camera that does something to its frames behind its driver's back.
class TamperedCamera final : public Camera {
 public:
  TamperedCamera(Camera& camera, std::function<void(std::uint64_t, CameraCounters&, std::optional<Frame>&)> tamper)
      : camera_(camera), tamper_(std::move(tamper)) {}
  CameraInfo info() const override { return camera_.info(); }
  Status start() override { return camera_.start(); }
  Result<std::optional<Frame>> try_grab() override {
    auto news = camera_.try_grab();
    if (news.ok() && news.value()) tamper_(++taken_, more_, news.value());
    return news;
  }
  void stop() noexcept override { camera_.stop(); }
  CameraCounters counters() const override {
    CameraCounters c = camera_.counters();
    c.delivered += more_.delivered;
    c.lost += more_.lost;
    return c;
  }
  Status trigger() override { return camera_.trigger(); }

 private:
  Camera& camera_;
  const std::function<void(std::uint64_t, CameraCounters&, std::optional<Frame>&)> tamper_;
  std::uint64_t taken_ = 0;
  CameraCounters more_;
};

struct AccountRig : testing_support::MockRig {
  TriggerSettings trigger;
  ScanResult result;  ///< however it ended
  std::unique_ptr<Camera> mono;

  void triggered(TriggerMode mode) {
    trigger = {mode, 4e-3, std::nullopt};
    mock.camera.triggered = true;
    mock.camera.trigger_delay = 3ms;
  }

  /// With something between the scan and the camera mono.
  void run(const std::function<std::unique_ptr<Camera>(Camera&)>& wrap) {
    power_on();
    mono = wrap(*cameras[0]);
    plan = std::make_unique<ScanPlan>(make_scan_plan(s, read_posture(*arm, clock, 1s)));
    ScanJob job{*plan,
                s,
                clock,
                *arm,
                *laser,
                {{mono ? mono.get() : cameras[0].get(), RecordWhen::kAll, {}, trigger},
                 {cameras[1].get(), RecordWhen::kDark, {}, trigger}},
                sink,
                stop,
                interlock_closed,
                progress};
    try {
      run_scan(job);
    } catch (const std::exception&) {
    }
    result = job.result;
  }
  void run() {
    run([](Camera&) { return nullptr; });
  }

  std::uint64_t count(const std::string& name) const {
    const auto found = result.counts.find(name);
    return found == result.counts.end() ? 0 : found->second;
  }
  std::string line(const std::string& camera) const {
    return account_line(result.counts, camera, result.account.at(camera));
  }
  void expect_closed() const {
    for (const char* camera : {"mono", "left"}) {
      const CameraAccount& account = result.account.at(camera);
      EXPECT_EQ(account.unaccounted, 0) << camera << ": " << line(camera) << "; " << result.status;
      const auto recorded = sink.of(camera, Phase::kSweep).size() + sink.of(camera, Phase::kDarkBefore).size() +
                            sink.of(camera, Phase::kDarkAfter).size();
      EXPECT_EQ(count(std::string(camera) + ".recorded"), recorded);
    }
  }
};

TEST(FrameAccount, SaysOfAScanThatLosesNothingThatAllIsRecorded) {
  AccountRig rig;
  rig.run();
  rig.expect_closed();
  EXPECT_TRUE(lost_nothing(rig.result.counts, "mono", rig.result.account.at("mono"))) << rig.line("mono");
  const std::uint64_t recorded = rig.count("mono.recorded");
  EXPECT_EQ(rig.line("mono"), std::to_string(recorded) + " of " + std::to_string(recorded) + " frames recorded");
  EXPECT_EQ(rig.result.account.at("mono").expected, recorded + rig.count("mono.not_recorded"));
  EXPECT_TRUE(rig.sink.told("summary", "camera mono: " + rig.line("mono")));
}

TEST(FrameAccount, ClosesWhateverIsLostAndHoweverTheScanEnds) {
  using Kind = sim::FaultKind;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto one_of = [&](auto... values) {
      const std::array all{values...};
      return all[random() % all.size()];
    };
    AccountRig rig;
    if (seed % 3 != 0) rig.triggered(seed % 3 == 1 ? TriggerMode::kPosition : TriggerMode::kSoftware);
    rig.mock.camera.drop_every = one_of(0, 0, 7, 10);
    rig.s.sync.max_residual = one_of(1e9, 3e-3);
    rig.s.sweep.passes = one_of(1, 2);
    rig.sink.throw_at = one_of(-1, -1, -1, 20);
    sim::FaultPlan plan;
    for (int i = 0; i < 2; ++i) {
      sim::FaultSpec fault;
      fault.device = sim::FaultDevice::kCamera;
      fault.camera = "mono";
      fault.kind = one_of(Kind::kDropped, Kind::kTorn, Kind::kDelayed, Kind::kIntermittent, Kind::kOff,
                          Kind::kClockJump, Kind::kUnplugged);
      fault.origin = sim::FaultOrigin::kStart;
      fault.at = from_seconds(std::uniform_real_distribution<double>(0, 12)(random));
      fault.duration = one_of(Duration{80ms}, Duration{300ms}, Duration{2s});
      fault.ratio = 0.3;
      fault.delay = 60ms;
      fault.jump = one_of(Duration{500ms}, Duration{-500ms});
      fault.seed = seed;
      plan.faults.push_back(fault);
    }
    const Stamp stop_at = Stamp{} + from_seconds(std::uniform_real_distribution<double>(1, 40)(random));
    rig.progress = [&](const ScanProgress&) {
      if (rig.clock.now() < stop_at) return;
      if (seed % 5 == 0) throw std::runtime_error("the screen broke");
      rig.stop = true;
    };
    sim::FaultScript script(plan);
    script.mark(sim::FaultOrigin::kStart, rig.clock.now());
    rig.run([&](Camera& camera) { return std::make_unique<sim::FaultyCamera>(camera, script, rig.clock); });
    rig.expect_closed();
    if (HasFailure()) return;
  }
}

TEST(FrameAccount, NamesASilenceThatNobodyNumbers) {
  AccountRig rig;
  rig.run([&](Camera& camera) {
    return std::make_unique<TamperedCamera>(camera,
                                            [](std::uint64_t taken, CameraCounters& more, std::optional<Frame>& frame) {
                                              if (taken < 130) return;  // near the sweep's end; none comes after it
                                              frame.reset();
                                              --more.delivered;
                                            });
  });
  EXPECT_GE(rig.count("mono.silent"), 1u) << rig.line("mono") << rig.result.status;
  EXPECT_TRUE(rig.sink.told("drop", "mono: silent x"));
  rig.expect_closed();
}

/// At every stop a frame is on its way, as with cameras behind wires.
class CameraWithAWire final : public Camera {
 public:
  explicit CameraWithAWire(Camera& camera) : camera_(camera) {}
  CameraInfo info() const override { return camera_.info(); }
  Status start() override { return camera_.start(); }
  Result<std::optional<Frame>> try_grab() override { return camera_.try_grab(); }
  void stop() noexcept override {
    camera_.stop();
    ++unread_;
  }
  CameraCounters counters() const override {
    CameraCounters c = camera_.counters();
    c.unread = unread_;
    return c;
  }

 private:
  Camera& camera_;
  std::uint64_t unread_ = 0;
};

TEST(FrameAccount, TakesNoFrameForLostThatIsOnItsWayWhenNobodyWantsMore) {
  AccountRig whole, rig;
  whole.run();
  rig.run([](Camera& camera) { return std::make_unique<CameraWithAWire>(camera); });
  rig.expect_closed();
  EXPECT_TRUE(lost_nothing(rig.result.counts, "mono", rig.result.account.at("mono"))) << rig.line("mono");
  EXPECT_EQ(rig.count("mono.recorded"), whole.count("mono.recorded"));
  EXPECT_GT(rig.count("mono.not_recorded"), whole.count("mono.not_recorded"));
}

TEST(FrameAccount, IsOpenWhereADriverLosesAFrameWithoutAWord) {
  for (const bool triggered : {false, true}) {
    AccountRig rig;
    if (triggered) rig.triggered(TriggerMode::kSoftware);
    rig.run([&](Camera& camera) {
      return std::make_unique<TamperedCamera>(camera,
                                              [](std::uint64_t taken, CameraCounters&, std::optional<Frame>& frame) {
                                                if (taken == 40 || taken == 50) frame.reset();
                                              });
    });
    EXPECT_EQ(rig.result.account.at("mono").unaccounted, 2) << rig.line("mono");
    EXPECT_TRUE(rig.sink.told("fault", "unaccounted")) << "and the session says so";
  }
}

TEST(FrameAccount, IsOpenWhereAFrameIsCountedTwice) {
  AccountRig rig;
  rig.triggered(TriggerMode::kSoftware);
  rig.run([&](Camera& camera) {
    return std::make_unique<TamperedCamera>(camera,
                                            [](std::uint64_t taken, CameraCounters& more, std::optional<Frame>&) {
                                              if (taken == 40) ++more.lost;  // and delivered
                                            });
  });
  EXPECT_EQ(rig.result.account.at("mono").unaccounted, -1) << rig.line("mono");
  EXPECT_THAT(rig.line("mono"), HasSubstr("counted twice 1"));
  EXPECT_TRUE(rig.sink.told("fault", "counted twice 1"));
}

}  // namespace
}  // namespace tankrig
