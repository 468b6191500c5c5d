// A synthesised CAN log, read back by the arm's own driver; stamps as wall time.
#include "session/export/export_candump.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>

#include "core/csv.hpp"
#include "core/input_error.hpp"
#include "drivers/can/can_log.hpp"
#include "session/export/export_csv.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using testing::HasSubstr;

/// A bus that plays a log; its stamps are the log's.
class LogBus final : public CanBus {
 public:
  explicit LogBus(const CanLog& log) {
    for (const CanLogEntry& entry : log.entries) {
      CanFrame frame{static_cast<std::uint16_t>(entry.frame.can_id), entry.frame.len, {}, {entry.wall_ns}};
      std::copy(entry.frame.data, entry.frame.data + entry.frame.len, frame.data.begin());
      frames_.push_back(frame);
    }
  }
  Status try_send(const CanFrame&) noexcept override { return {}; }
  void send_regardless(const CanFrame&) noexcept override {}
  Result<std::optional<CanFrame>> try_receive() noexcept override {
    if (frames_.empty()) return std::optional<CanFrame>{};
    const CanFrame frame = frames_.front();
    frames_.pop_front();
    return std::optional<CanFrame>(frame);
  }
  CanState state() const noexcept override { return CanState::kErrorActive; }
  CanCounters counters() const noexcept override { return {}; }
  Status reopen() noexcept override { return {}; }
  int descriptor() const noexcept override { return -1; }

 private:
  std::deque<CanFrame> frames_;
};

std::vector<JointState> some_joints() {
  std::vector<JointState> joints(50);
  for (int i = 0; i < 50; ++i) {
    JointState& state = joints[static_cast<std::size_t>(i)];
    state.stamp.ns = 1'000'000'000 + i * 10'000'123LL;
    for (int j = 0; j < kJoints; ++j) state.ticks[static_cast<std::size_t>(j)] = 1000 * (j + 1) - 37 * i * (j - 2);
    state.current_a = 0.5 + 0.01 * i;
  }
  return joints;
}

Session some_session() {
  Session session;
  session.path = "some";
  session.info.kind = "scan";
  session.info.clock_begin = ClockPair{{500'000'000}, 1'700'000'000'500'000'000};
  return session;
}

TEST(SynthesisedCandump, IsReadByTheArmsDriverAsTheJointsItWasMadeOf) {
  const std::vector<JointState> joints = some_joints();
  const WallClock clock(some_session(), joints[0].stamp);
  const std::string text = synthesised_candump(joints, {}, 1'000'000, clock);
  CanArmLink link(std::make_unique<LogBus>(parse_can_log(text)), {}, 1'000'000);
  for (const JointState& state : joints) {
    const auto answer = link.try_receive({});
    ASSERT_TRUE(answer.ok() && answer.value());
    for (std::size_t j = 0; j < kJoints; ++j)
      EXPECT_EQ(answer.value()->joints[j].position, static_cast<std::uint16_t>(state.ticks[j]));
    EXPECT_NEAR(laboratory_scaling().amperes(answer.value()->master.current), state.current_a, 0.06);
    EXPECT_NEAR(static_cast<double>(answer.value()->read.ns - clock.at(state.stamp)), 0,
                2000);  // candump's microsecond
  }
  EXPECT_FALSE(link.try_receive({}).value());
  EXPECT_THAT(text, HasSubstr(" synth0 "));
}

TEST(WallClock, FollowsTheClocksReadAtTheBeginning) {
  const WallClock clock(some_session(), {});
  EXPECT_EQ(clock.at({2'500'000'000}), 1'700'000'002'500'000'000);
}

TEST(WallClock, OfASessionWithoutClocksBeginsAtItsCreation) {
  Session session = some_session();
  session.info.clock_begin.reset();
  session.info.created_utc = "2023-11-14T22:13:20Z";
  const WallClock clock(session, {7});
  EXPECT_EQ(clock.at({7}), 1'700'000'000'000'000'000);
  session.info.created_utc = "yesterday";
  EXPECT_THAT(message_of<InputError>([&] { WallClock(session, {}); }), HasSubstr("created_utc: found 'yesterday'"));
}

/// The only line of a table, by its columns.
std::map<std::string, std::string> row_of(const std::string& table) {
  const std::size_t end = table.find('\n');
  const auto header = split_csv_line(table.substr(0, end)),
             fields = split_csv_line(table.substr(end + 1, table.size() - end - 2));
  EXPECT_EQ(header.size(), fields.size());
  std::map<std::string, std::string> row;
  for (std::size_t i = 0; i < std::min(header.size(), fields.size()); ++i) row[header[i]] = fields[i];
  return row;
}

TEST(FlatTables, PutJointsAndEventsUnderTheirNames) {
  const WallClock clock(some_session(), {});
  JointState state;
  state.stamp.ns = 2'500'000'000;
  for (std::size_t j = 0; j < kJoints; ++j) {
    state.q[static_cast<int>(j)] = 0.1 * static_cast<double>(j + 1);
    state.velocity[static_cast<int>(j)] = -0.01 * static_cast<double>(j + 1);
    state.ticks[j] = static_cast<std::int32_t>(100 + j);
  }
  state.current_a = 1.5;
  const auto joints = row_of(flat_joints_csv({state}, {2'000'000'000}, clock));
  EXPECT_EQ(joints.at("time_s"), "0.500000000");
  EXPECT_EQ(joints.at("wall_ns"), "1700000002500000000");
  for (std::size_t j = 0; j < kJoints; ++j) {
    const std::string name = kJointNames[j];
    EXPECT_EQ(std::stod(joints.at("q_" + name + "_rad")), state.q[static_cast<int>(j)]) << name;
    EXPECT_EQ(std::stod(joints.at("velocity_" + name + "_rad_s")), state.velocity[static_cast<int>(j)]) << name;
    EXPECT_EQ(joints.at(name + "_ticks"), std::to_string(100 + j));
  }
  EXPECT_EQ(joints.at("current_a"), "1.5");

  const auto event = row_of(flat_events_csv({{{2'250'000'000}, "fault", "a, b"}}, {2'000'000'000}, clock));
  EXPECT_EQ(event.at("time_s"), "0.250000000");
  EXPECT_EQ(event.at("wall_ns"), "1700000002250000000");
  EXPECT_EQ(event.at("kind"), "fault");
  EXPECT_EQ(event.at("text"), "a, b");
}

TEST(FlatTables, SpellOutTimeAndPose) {
  Session session = some_session();
  session.info.calibration.arm = arm5e();
  FrameRecord frame;
  frame.camera = "mono";
  frame.stamp.ns = 1'750'000'000;
  frame.phase = Phase::kSweep;
  frame.q = JointVector::Constant(0.5);
  frame.file = "frames/mono/000000.png";
  session.frames.push_back(frame);
  const std::string text = flat_frames_csv(session, {1'500'000'000}, WallClock(session, {}));
  const auto row = row_of(text);
  EXPECT_EQ(row.at("time_s"), "0.250000000");
  EXPECT_EQ(row.at("wall_ns"), "1700000001750000000");
  const Transform bMe = arm5e().bMe(*frame.q);
  const Transform read =
      make_transform({std::stod(row.at("bMe_x_m")), std::stod(row.at("bMe_y_m")), std::stod(row.at("bMe_z_m"))},
                     {std::stod(row.at("bMe_qx")), std::stod(row.at("bMe_qy")), std::stod(row.at("bMe_qz")),
                      std::stod(row.at("bMe_qw"))});
  EXPECT_TRUE(read.isApprox(bMe, 1e-12));
  session.frames[0].q.reset();
  EXPECT_THAT(flat_frames_csv(session, {}, WallClock(session, {})), HasSubstr(",,,,,,,"));
}

}  // namespace
}  // namespace tankrig
