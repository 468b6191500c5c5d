// What a session says of frames that are neither recorded nor left out for a reason.
#include "session/reading/frame_account.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/text_files.hpp"
#include "session/checking/checksums.hpp"
#include "session/checking/session_findings.hpp"
#include "session/checking/session_recover.hpp"
#include "session/reading/session_summary.hpp"
#include "tests/session/some_session.hpp"

namespace tankrig {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::Pair;

/// Five frames of eight or more, and why the others are not there; sealed.
std::filesystem::path session_with(const TemporaryFolder& folder, std::uint64_t expected) {
  SessionInfo info = some_info();
  info.counts["mono.incomplete"] = 2;
  info.counts["mono.not_recorded"] = 1;
  info.counts["cycle.overruns"] = 17;
  info.account["mono"].expected = expected;
  SessionWriter writer(folder.path() / "s", info);
  record(writer, 5);
  writer.close("complete");
  write_checksums(folder.path() / "s");
  return folder.path() / "s";
}

void describe_nothing(const std::filesystem::path&, SessionInfo&) {}

TEST(FrameAccount, IsKeptInTheSessionAndClosesWhereEveryFrameHasItsFate) {
  const TemporaryFolder folder;
  const Session session = Session::open(session_with(folder, 8));
  ASSERT_TRUE(session.info.account.contains("mono"));
  EXPECT_EQ(session.info.account.at("mono").expected, 8u);
  EXPECT_EQ(session.info.account.at("mono").unaccounted, 0);
  EXPECT_THAT(examine_session(session.path, describe_nothing).losses, Not(Contains(HasSubstr("mono"))));
  EXPECT_THAT(session_summary(session), Contains(Pair("frames of mono", "5 of 7 frames recorded: incomplete 2")));
}

TEST(FrameAccount, ThatDoesNotCloseIsALossOfTheSession) {
  const TemporaryFolder folder;
  const auto path = session_with(folder, 11);
  EXPECT_EQ(Session::open(path).info.account.at("mono").unaccounted, 3);
  EXPECT_THAT(examine_session(path, describe_nothing).losses,
              Contains("camera mono: of 11 frames 3 are neither recorded nor left out for a reason"));
  EXPECT_THAT(session_summary(Session::open(path)),
              Contains(Pair("frames of mono", "5 of 10 frames recorded: incomplete 2, unaccounted 3")));
}

TEST(FrameAccount, ThatCountsAFrameTwiceIsALossToo) {
  const TemporaryFolder folder;
  const auto path = session_with(folder, 7);
  EXPECT_EQ(Session::open(path).info.account.at("mono").unaccounted, -1);
  EXPECT_THAT(examine_session(path, describe_nothing).losses, Contains("camera mono: of 7 frames 1 are counted twice"));
}

TEST(FrameAccount, IsToldOnceOfASessionThatWasRecovered) {
  const TemporaryFolder folder;
  const auto path = session_with(folder, 11);
  std::filesystem::remove(path / "frames/mono/000002.png");
  RecoverOptions how;
  how.describe = describe_nothing;
  recover_session(path, how);
  const Session session = Session::open(path);
  EXPECT_THAT(session.info.recovered, Contains(HasSubstr("3 are neither recorded")));
  EXPECT_EQ(session.info.counts.at("mono.recorded"), 4u);
  EXPECT_EQ(session.info.counts.at("mono.lost_from_session"), 1u);
  EXPECT_EQ(unaccounted(session.info.counts, "mono", 11), 3) << "of the recording, as before";
  EXPECT_THAT(examine_session(path, describe_nothing).losses, Not(Contains(HasSubstr("mono"))));
}

TEST(FrameAccount, TakesForReasonsWhatTheCameraHasCountsOf) {
  const FrameCounts counts{{"left.lost", 4},         {"mono.lost", 3},   {"mono.overrun", 0},  {"mono.recorded", 90},
                           {"mono.not_recorded", 7}, {"mono.x.lost", 5}, {"cycle.overruns", 9}};
  EXPECT_THAT(frame_reasons(counts, "mono"), ElementsAre(Pair("lost", 3), Pair("not_recorded", 7)));
  EXPECT_EQ(unaccounted(counts, "mono", 100), 0);
  EXPECT_EQ(account_line(counts, "mono", {100, 0}), "90 of 93 frames recorded: lost 3");
  EXPECT_FALSE(lost_nothing(counts, "mono", {100, 0}));
  EXPECT_TRUE(lost_nothing({{"mono.recorded", 9}, {"mono.not_recorded", 1}}, "mono", {10, 0}));
}

TEST(FrameAccount, OfACraftedSessionIsBelievedNoFurtherThanItsCounts) {
  const TemporaryFolder folder;
  const auto path = session_with(folder, 11);
  std::string yaml = read_whole_file(path / "session.yaml");
  yaml.replace(yaml.find("unaccounted: 3"), 14, "unaccounted: 0");
  write_whole_file(path / "session.yaml", yaml);
  EXPECT_EQ(Session::open(path).info.account.at("mono").unaccounted, 3);
  EXPECT_EQ(account_line({{"mono.not_recorded", 7}}, "mono", {5, 0}), "0 of 0 frames recorded");
  EXPECT_EQ(unaccounted({}, "mono", std::uint64_t{1} << 63), INT64_MAX);
  EXPECT_EQ(unaccounted({{"mono.recorded", std::uint64_t{1} << 63}}, "mono", 0), -INT64_MAX);
}

TEST(FrameAccount, WhoseCountsAreLostIsGivenUp) {
  const TemporaryFolder folder;
  const auto path = session_with(folder, 8);
  std::string yaml = read_whole_file(path / "session.yaml");
  yaml.replace(yaml.find("\ncounts:"), 8, "\ncovnts:");
  write_whole_file(path / "session.yaml", yaml);
  RecoverOptions how;
  how.describe = describe_nothing;
  recover_session(path, how);
  EXPECT_FALSE(Session::open(path).info.account.contains("mono"));
  EXPECT_TRUE(examine_session(path, describe_nothing).whole());
}

}  // namespace
}  // namespace tankrig
