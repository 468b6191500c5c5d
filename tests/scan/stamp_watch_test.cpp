// A camera's clock that jumps is found by the first frame it stamps, and one that is merely unsure is not accused.
#include "rig/capture/stamp_watch.hpp"

#include <gtest/gtest.h>

namespace tankrig {
namespace {

using namespace std::chrono_literals;

constexpr Duration kPeriod = 40ms, kOnItsWay = 30ms;

/// A camera's frames, each come kOnItsWay after its exposure.
struct Stamped {
  StampWatch sut;
  Stamp truth{};
  Duration jump{}, sigma = 100us;

  std::string next() {
    truth = truth + kPeriod;
    Frame frame;
    frame.stamp = truth + jump;
    frame.stamp_sigma = sigma;
    return sut.judge(frame, truth + kOnItsWay);
  }
};

TEST(StampWatch, TellsAClockThatJumpsAheadOfTheFramesArrival) {
  Stamped camera;
  EXPECT_EQ(camera.next(), "");
  camera.jump = 500ms;
  EXPECT_EQ(camera.next(), "its clock jumped: a frame stamped 470 ms after it came");
}

TEST(StampWatch, TellsAClockThatJumpsBackInEveryFrameUntilItsStampsAreNewAgain) {
  Stamped camera;
  EXPECT_EQ(camera.next(), "");
  camera.jump = -150ms;
  EXPECT_EQ(camera.next(), "its clock jumped: a frame stamped 110 ms before the one before it");
  EXPECT_NE(camera.next(), "");
  EXPECT_NE(camera.next(), "");
  EXPECT_EQ(camera.next(), "");
}

TEST(StampWatch, LeavesACameraAloneWhoseOffsetIsStillToBeCalibrated) {
  for (const Duration offset : {-60ms, 60ms}) {
    Stamped camera;
    camera.jump = offset;
    for (int i = 0; i < 10; ++i) EXPECT_EQ(camera.next(), "");
  }
}

TEST(StampWatch, LeavesToTheGateWhatAStampsOwnSigmaAllows) {
  Stamped camera;
  EXPECT_EQ(camera.next(), "");
  camera.sigma = 30ms;
  for (const Duration jump : {-90ms, 180ms, -40ms}) {
    camera.jump = jump;
    EXPECT_EQ(camera.next(), "") << jump.count();
    camera.truth = camera.truth + 300ms;
  }
}

}  // namespace
}  // namespace tankrig
