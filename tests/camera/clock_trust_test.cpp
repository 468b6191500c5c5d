// A device's clock that is set while frames come: none is given out with a stamp of another time.
#include "drivers/camera/clock_trust.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using Word = ClockTrust::Word;

constexpr Duration kPeriod = 40ms, kExposure = 10ms, kInFlight = 200ms, kBracket = 200us;

/// A camera at 25 frames/s whose clock is read after each frame, as its driver does.
struct Watched {
  explicit Watched(unsigned seed) : random(seed) {}

  std::mt19937 random;
  ClockTrust sut;
  std::int64_t device_offset = 5'000'000'000'000;
  Stamp jump_at{std::numeric_limits<std::int64_t>::max()};
  Duration jump{};
  Stamp now{1'000'000'000'000};
  int sure = 0, unsure = 0;
  Duration worst{};         ///< error of a stamp that was given out
  double worst_sigmas = 0;  ///< likewise, in its own sigmas

  double uniform(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random); }

  std::int64_t device_at(Stamp host) const { return host.ns + device_offset + (host < jump_at ? 0 : jump.count()); }

  /// The truth is anywhere in the bracket.
  ClockSample reading() {
    const Stamp truth = now + from_seconds(uniform(-0.5, 0.5) * seconds(kBracket));
    return {device_at(truth), now, from_seconds(seconds(kBracket) / std::sqrt(12.0))};
  }

  void read(bool keep) {
    for (int i = 0; i < 5; ++i) {
      const std::uint64_t newest = sut.newest();
      now = now + 1ms;
      if (sut.add_reading(reading(), newest, keep || i > 0)) return;
    }
  }

  /// Exposed at the grid's next time, stamped at the start of its exposure, here some time later.
  void frame(Stamp begin, bool keep) {
    const std::int64_t stamp = device_at(begin);
    const Stamp arrival = begin + kExposure + from_seconds(uniform(1e-3, 30e-3));
    now = std::max(now, arrival);
    const std::uint64_t number = sut.add_frame();
    EXPECT_EQ(sut.word(number, arrival - kExposure - kInFlight), Word::kWait) << "nobody has asked the clock since";
    read(keep);
    const Word word = sut.word(number, arrival - kExposure - kInFlight);
    if (word == Word::kUnsure) ++unsure;
    if (word != Word::kSure) return;
    ++sure;
    const MappedStamp mapped = *sut.fit().map(stamp);
    const Duration error{std::abs(mapped.stamp.ns - begin.ns)};
    worst = std::max(worst, error);
    worst_sigmas = std::max(worst_sigmas, seconds(error) / std::hypot(seconds(mapped.sigma), seconds(sut.sigma())));
  }

  void run(int frames) {
    for (int i = 0; i < 6; ++i) read(true), now = now + 200ms;
    const Stamp zero = now + kPeriod;
    for (int i = 0; i < frames; ++i) frame(zero + kPeriod * i, i % 25 == 0);
  }
};

TEST(ClockTrust, GivesOutNoFrameWithAStampOfAnotherTimeHoweverItsClockJumps) {
  for (const Duration jump :
       {Duration{500us}, Duration{-500us}, Duration{3ms}, Duration{-3ms}, Duration{20ms}, Duration{-20ms},
        Duration{39ms}, Duration{-39ms}, Duration{500ms}, Duration{-500ms}, Duration{1h}, Duration{-1h}})
    for (unsigned seed = 1; seed <= 20; ++seed) {
      Watched camera(seed);
      camera.jump = jump;
      camera.jump_at = camera.now + 3s + from_seconds(camera.uniform(0, 0.1));
      camera.run(100);
      EXPECT_LT(camera.worst_sigmas, 5 + std::sqrt(3.0))  // what a reading may be beside the line, and beside the truth
          << "jump of " << seconds(jump) << " s, seed " << seed;
      EXPECT_EQ(camera.sure + camera.unsure, 100);
      if (std::chrono::abs(jump) < 1ms) continue;  // as small as what the line may be off by: its sigma says so
      EXPECT_LT(camera.worst, 200us) << "jump of " << seconds(jump) << " s, seed " << seed;
      EXPECT_EQ(camera.sut.fit().jumps(), 1u) << "jump of " << seconds(jump) << " s, seed " << seed;
      EXPECT_GE(camera.unsure, 1);
      EXPECT_LE(camera.unsure, 8) << "those on their way, and no more";
    }
}

TEST(ClockTrust, BelievesEveryFrameOfAClockThatOnlyGoesOn) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    Watched camera(seed);
    camera.run(200);
    EXPECT_EQ(camera.sure, 200) << "seed " << seed;
    EXPECT_LT(camera.worst, 200us) << "seed " << seed;
  }
}

TEST(ClockTrust, TakesAReadingThatIsOffAloneForNoise) {
  Watched camera(3);
  camera.run(20);
  const std::uint64_t number = camera.sut.add_frame();
  ClockSample late = camera.reading();
  late.host = late.host + 20ms;
  EXPECT_FALSE(camera.sut.add_reading(late, number, false));
  EXPECT_EQ(camera.sut.word(number, camera.now), Word::kWait) << "noise, or a jump: not known yet";
  EXPECT_TRUE(camera.sut.in_doubt());
  camera.read(false);
  EXPECT_EQ(camera.sut.word(number, camera.now), Word::kSure);
  EXPECT_FALSE(camera.sut.in_doubt());
}

TEST(ClockTrust, SaysHowWideTheReadingIsThatVouches) {
  Watched camera(4);
  camera.run(5);
  camera.sut.add_frame();
  ClockSample wide = camera.reading();
  wide.sigma = 3ms;
  EXPECT_TRUE(camera.sut.add_reading(wide, camera.sut.newest(), false));
  EXPECT_EQ(camera.sut.sigma(), 3ms) << "a jump of some milliseconds would not have shown";
}

}  // namespace
}  // namespace tankrig
