// A zero of another program is believed only with proof, and no program that may move the arm leaves one by dying.
#include "drivers/arm/zero_proof.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>

#include "core/input_error.hpp"
#include "tests/arm/still_arm.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing_support::StillArm;

constexpr std::array<std::uint16_t, kJoints> kLeft{1000, 2000, 3000, 0, 0};  // the jaw has not moved since power-up

/// The zero file of an arm at 0.1 rad or so, left at kLeft.
struct ZeroFile {
  TemporaryFolder folder;
  std::filesystem::path path = folder.path() / "zero.yaml";

  ZeroFile() {
    ArmZero zero{{}, "2026-01-31T12:00:00Z", ArmZero::OrderlyExit{kLeft, "2026-01-31T13:00:00Z"}};
    const ArmModel model = arm5e();
    JointVector q;
    q << 0.1, 0.2, 1.0, 0, 0.1;
    for (std::size_t j = 0; j < kJoints; ++j)
      zero.raw[j] =
          static_cast<std::uint16_t>(kLeft[j] - std::lround(model.actuators[j].ticks(q[static_cast<Eigen::Index>(j)])));
    save_arm_zero(path, zero);
  }
  ArmZero now() const { return load_arm_zero(path); }
};

/// A program that has the arm open, under a clock that stands still.
struct Program : StillArm {
  explicit Program(const ZeroFile& file) {
    arm->set_proof(ZeroProof(file.path, only(kSlew) | only(kShoulder) | only(kElbow)));
    acknowledge();
    (void)arm->try_read();
  }
  std::optional<JointState> reads(const std::array<std::uint16_t, kJoints>& raw, int times = 4) {
    std::optional<JointState> state;
    for (int i = 0; i < times; ++i) {
      pass(arm->exchange_period());
      (void)drive_ticks(*arm, {});
      answer(raw);
      if (const auto news = arm->try_read(); news.ok() && news.value()) state = news.value();
    }
    return state;
  }
};

std::array<std::uint16_t, kJoints> with(Joint joint, int raw) {
  auto all = kLeft;
  all[joint] = static_cast<std::uint16_t>(raw);
  return all;
}

TEST(ZeroProof, BelievesAnArmThatStandsWhereItWasLeft) {
  const ZeroFile file;
  Program program(file);
  EXPECT_FALSE(program.arm->homed()) << "nothing has been read";
  const auto state = program.reads(with(kElbow, kLeft[kElbow] + ZeroProof::kSettled));
  ASSERT_TRUE(state);
  EXPECT_TRUE(program.arm->homed());
  EXPECT_EQ(program.arm->why_not_homed(), "");
  EXPECT_NEAR(state->q[kElbow], 1.0, 3e-3);
}

TEST(ZeroProof, DoesNotBelieveAnArmThatStandsElsewhereAndVoidsTheFile) {
  for (const int off : {ZeroProof::kSettled + 1, -ZeroProof::kSettled - 1, 20'000}) {
    const ZeroFile file;
    {
      Program program(file);
      ASSERT_TRUE(program.reads(with(kElbow, kLeft[kElbow] + off)));
      EXPECT_FALSE(program.arm->homed());
      EXPECT_THAT(program.arm->why_not_homed(), HasSubstr("elbow reads " + std::to_string(kLeft[kElbow] + off) +
                                                          ", but 3000 where it was left at 2026-01-31T13:00:00Z"));
      program.arm->keep_loss();
    }
    EXPECT_THAT(file.now().voided, HasSubstr("elbow reads"));
    Program later(file);
    ASSERT_TRUE(later.reads(kLeft)) << "by chance it stands there again";
    EXPECT_FALSE(later.arm->homed());
    EXPECT_THAT(later.arm->why_not_homed(),
                HasSubstr("its zero of 2026-01-31T12:00:00Z is no longer valid: elbow reads"));
  }
}

/// Switched off over night: the encoders begin at 0, and waver.
TEST(ZeroProof, DoesNotBelieveAJointThatReadsAsAtPowerUpOnEitherSideOfTheWrap) {
  for (const int raw : {0, 1, 2, 65534, 65535}) {
    const ZeroFile file;
    ArmZero zero = file.now();
    zero.exit->raw[kElbow] = static_cast<std::uint16_t>(raw);
    save_arm_zero(file.path, zero);
    Program program(file);
    ASSERT_TRUE(program.reads(with(kElbow, raw)));
    EXPECT_FALSE(program.arm->homed()) << raw << ": it was left there, and that proves nothing";
    EXPECT_THAT(program.arm->why_not_homed(), HasSubstr("as after power-up"));
  }
}

TEST(ZeroProof, ComparesAcrossTheWrap) {
  const ZeroFile file;
  ArmZero zero = file.now();
  zero.raw[kElbow] = static_cast<std::uint16_t>(zero.raw[kElbow] + 65533 - kLeft[kElbow]);
  zero.exit->raw[kElbow] = 65533;
  save_arm_zero(file.path, zero);
  Program program(file);
  ASSERT_TRUE(program.reads(with(kElbow, 65532)));
  EXPECT_TRUE(program.arm->homed()) << program.arm->why_not_homed();
}

TEST(ZeroProof, DoesNotBelieveAFileWithoutARecordOfAnOrderlyEndButParsesIt) {
  const ZeroFile file;
  ArmZero old = file.now();
  old.exit.reset();
  save_arm_zero(file.path, old);
  Program program(file);
  ASSERT_TRUE(program.reads(kLeft));
  EXPECT_FALSE(program.arm->homed());
  EXPECT_THAT(program.arm->why_not_homed(), HasSubstr("no record of an orderly end"));
}

TEST(ZeroProof, IsNotOnDiskWhileAProgramMayMoveTheArmSoThatAKillLeavesNone) {
  const ZeroFile file;
  {
    Program program(file);
    ASSERT_TRUE(program.reads(kLeft));
    EXPECT_EQ(drive_ticks(*program.arm, {0, 0, 300, 0, 0}).error().code, ErrorCode::kRefused) << "opened to be read";
    EXPECT_TRUE(file.now().exit) << "a program that only reads leaves it";
    program.arm->begin_motion();
    EXPECT_TRUE(drive_ticks(*program.arm, {0, 0, 300, 0, 0}).ok());
    EXPECT_FALSE(file.now().exit);
  }  // as by a kill: no end_motion()
  Program next(file);
  ASSERT_TRUE(next.reads(kLeft));
  EXPECT_FALSE(next.arm->homed());
}

TEST(ZeroProof, IsKeptAgainByAProgramThatEndsInAnOrderlyWayWithTheArmAtRest) {
  const ZeroFile file;
  const auto there = with(kElbow, kLeft[kElbow] + 40);
  for (const bool rests : {true, false}) {
    Program program(file);
    ASSERT_TRUE(program.reads(rests ? kLeft : there));
    ASSERT_TRUE(program.arm->homed()) << program.arm->why_not_homed();
    program.arm->begin_motion();
    ASSERT_TRUE(program.reads(there));
    program.arm->end_motion(rests);
    EXPECT_EQ(file.now().exit.has_value(), rests);
    if (rests) {
      EXPECT_EQ(file.now().exit->raw, there);
    }
    EXPECT_FALSE(drive_ticks(*program.arm, {0, 0, 300, 0, 0}).ok()) << "it is not driven any more";
  }
}

TEST(ZeroProof, EndsOnDiskWithALossOfReference) {
  const ZeroFile file;
  Program program(file);
  ASSERT_TRUE(program.reads(kLeft));
  program.arm->begin_motion();
  (void)program.reads(with(kElbow, 20'000), 3);
  ASSERT_FALSE(program.arm->homed());
  program.arm->end_motion(true);
  EXPECT_FALSE(file.now().exit);
  EXPECT_THAT(file.now().voided, HasSubstr("an encoder lost its reference"));
}

TEST(ZeroProof, LetsOneProgramAtATimeMoveTheArm) {
  const ZeroFile file;
  Program first(file), second(file);
  ASSERT_TRUE(first.reads(kLeft) && second.reads(kLeft));
  first.arm->begin_motion();
  EXPECT_THAT(message_of<InputError>([&] { second.arm->begin_motion(); }),
              HasSubstr("another program is moving the arm; wait for it to end"));
  ASSERT_TRUE(first.reads(with(kElbow, kLeft[kElbow] + 30)));
  first.arm->end_motion(true);
  EXPECT_THAT(message_of<InputError>([&] { second.arm->begin_motion(); }), HasSubstr("run it again"));
}

TEST(ZeroProof, IsNotLookedForWhileAnotherProgramMovesTheArmWhateverTheFileSays) {
  const ZeroFile file;
  Program mover(file);
  ASSERT_TRUE(mover.reads(kLeft));
  mover.arm->begin_motion();
  ArmZero zero = file.now();
  const auto refused = [&] {
    EXPECT_THAT(message_of<InputError>([&] { Program reader(file); }), HasSubstr("another program is moving the arm"));
  };
  refused();
  zero.exit = {kLeft, "2026-01-31T13:00:00Z"};
  save_arm_zero(file.path, zero);
  refused();
  zero.voided = "an encoder lost its reference";
  save_arm_zero(file.path, zero);
  refused();
  std::filesystem::remove(file.path);
  refused();
  mover.arm.reset();
  EXPECT_NO_THROW(Program reader(file));
}

/// What it noticed is of the zero that it knows, and of nothing else.
TEST(ZeroProof, OfAnotherProgramIsNotVoidedByOneThatBeganBefore) {
  const auto there = with(kElbow, kLeft[kElbow] + 40);
  for (const bool judged : {true, false}) {
    const ZeroFile file;
    Program before(file), mover(file);
    if (judged) {
      ASSERT_TRUE(before.reads(kLeft));
    }
    ASSERT_TRUE(mover.reads(kLeft));
    mover.arm->begin_motion();
    ASSERT_TRUE(mover.reads(there));
    mover.arm->end_motion(true);
    const ArmZero left = file.now();
    (void)before.reads(judged ? with(kElbow, 20'000) : there);
    ASSERT_FALSE(before.arm->homed());
    before.arm->keep_loss();
    EXPECT_EQ(file.now(), left);
  }
}

TEST(ZeroProof, TellsAlsoWhereItCannotBeVoidedWhyItDoesNotHold) {
  const ZeroFile file;
  std::filesystem::create_directory(file.path.string() + ".lock");
  Program program(file);
  ASSERT_TRUE(program.reads(with(kElbow, 20'000)));
  EXPECT_THAT(message_of<InputError>([&] { program.arm->keep_loss(); }), HasSubstr("cannot be locked"));
  EXPECT_THAT(program.arm->why_not_homed(), HasSubstr("elbow reads 20000"));
}

}  // namespace
}  // namespace tankrig
