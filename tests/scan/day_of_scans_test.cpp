// Hours of scans in virtual time, ended in every orderly way there is: neither the guardian nor a watchdog box takes one for
// a program that died.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <map>
#include <random>

#include "rig/guardian/guardian_step.hpp"
#include "rig/safety/step_watch.hpp"
#include "sim_backends/wire/box_logic.hpp"
#include "tests/support/mock_rig.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

/// What guardian and box decide, in the program's own steps: they look whenever the cycle does.
class Watchers final : public StepWatch {
 public:
  explicit Watchers(const Clock& clock) : clock_(clock) {}

  void begin(Duration patience) noexcept override { patience_ = patience, released_ = false; }
  const char* objection(Stamp now) noexcept override {
    ++looks_;
    const GuardianStep next = step(state_, {now, steps_, watched_, false, false, false, patience_});
    state_ = next.state;
    taken_over_ = taken_over_ || next.act != GuardianAct::kWatch;
    box_.button(box_.ready() && !closed_, now);
    box_.tick(closed_, now);
    opened_ = opened_ || (closed_ && !box_.coil());
    closed_ = box_.coil();
    return nullptr;
  }
  void completed(const OutputRight& /*right*/) noexcept override {
    ++steps_;
    watched_ = !released_;
    if (const Stamp now = clock_.now(); now - edge_ >= kHalfPeriod) box_.edge(edge_ = now);
  }
  void release() noexcept override { watched_ = false, released_ = true; }

  bool taken_over() const { return taken_over_; }
  bool opened() const { return opened_; }
  bool closed() const { return closed_; }
  /// The program may end without being missed.
  bool let_go() const { return !watched_; }
  std::uint64_t looks() const { return looks_; }
  std::uint64_t steps() const { return steps_; }

 private:
  static constexpr Duration kHalfPeriod = 20ms;

  const Clock& clock_;
  GuardianState state_;
  sim::BoxLogic box_;
  Duration patience_{};
  Stamp edge_{};
  std::uint64_t steps_ = 0, looks_ = 0;
  bool watched_ = false, released_ = false, taken_over_ = false, opened_ = false, closed_ = false;
};

enum class End : std::uint8_t { kPlan, kStop, kInterlock, kSink, kWays };

// TANKRIG_DAY_HOURS: so many hours instead; `ctest -R scan.day` has 24.
TEST(ADayOfScans, IsNoFalseAlarmHoweverTheyEnd) {
  const char* const wanted = std::getenv("TANKRIG_DAY_HOURS");
  const double hours = wanted ? std::atof(wanted) : 2;
  const std::uint64_t seed = 15;
  RecordProperty("seed", static_cast<int>(seed));
  std::mt19937_64 random(seed);
  std::map<End, int> ended;
  double simulated_s = 0;
  std::uint64_t steps = 0;
  for (int scan = 0; simulated_s < 3600 * hours; ++scan) {
    testing_support::MockRig rig;
    Watchers watchers(rig.clock);
    const auto way = scan == 0 ? End::kPlan : static_cast<End>(random() % static_cast<std::uint64_t>(End::kWays));
    const double when = 0.05 + 0.9 * static_cast<double>(random() % 1000) / 1000;
    bool now = false;
    rig.step_watch = &watchers;
    rig.progress = [&](const ScanProgress& p) {
      now = now || p.fraction >= when;
      if (now && way == End::kStop) rig.stop = true;
    };
    rig.interlock_closed = [&] { return !(now && way == End::kInterlock); };
    if (way == End::kSink) rig.sink.throw_at = 1 + static_cast<int>(random() % 20);
    bool threw = false;
    try {
      const ScanResult result = rig.run();
      ASSERT_EQ(result.complete(), way == End::kPlan || (way == End::kInterlock && result.complete())) << result.status;
    } catch (const std::exception&) {
      threw = true;
    }
    ASSERT_EQ(threw, way == End::kSink) << "scan " << scan << ", seed " << seed;
    ASSERT_FALSE(watchers.taken_over()) << "scan " << scan << ", seed " << seed;
    ASSERT_FALSE(watchers.opened()) << "scan " << scan << ", seed " << seed;
    ASSERT_TRUE(watchers.closed()) << "it was never enabled: scan " << scan << ", seed " << seed;
    ASSERT_TRUE(rig.left.safe() && watchers.let_go()) << "scan " << scan << ", seed " << seed;
    ASSERT_EQ(watchers.steps(), watchers.looks()) << "a step was not completed";
    ++ended[way];
    simulated_s += seconds(rig.clock.now() - Stamp{});
    steps += watchers.steps();
  }
  std::printf("%.1f h of scans, %llu steps: %d to their end, %d stopped, %d by the interlock, %d by a full disk\n",
              simulated_s / 3600, static_cast<unsigned long long>(steps), ended[End::kPlan], ended[End::kStop],
              ended[End::kInterlock], ended[End::kSink]);
}

}  // namespace
}  // namespace tankrig
