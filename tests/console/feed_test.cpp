// The program on a terminal, as the console starts it: what it feeds, and how it takes the terminal's keys.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <regex>
#include <set>

#include "console/feed/feed_format.hpp"
#include "console/server/terminal_program.hpp"
#include "core/clock.hpp"
#include "pipeline/live_reconstruction.hpp"
#include "session/reading/session.hpp"
#include "tests/program/benchmark_text.hpp"
#include "tests/program/program.hpp"
#include "tests/support/machine_witness.hpp"

namespace tankrig::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

constexpr int kPatience_ms = 120'000;  // between two signs of life

/// A message of points.
struct Batch {
  Stamp frame, came;
};

/// What came, up to the program's end.
struct Heard {
  std::string screen;
  std::vector<json> texts;
  std::vector<Batch> batches;
  std::size_t points = 0;
  bool all_finite = true;
  std::map<std::string, cv::Mat> pictures;
  int exit_code = -1;

  std::vector<json> of(const char* feed) const {
    std::vector<json> found;
    for (const json& text : texts)
      if (text.at("feed") == feed) found.push_back(text);
    return found;
  }
};

void take(std::string_view message, Heard& heard) {
  if (const auto camera = pictured_camera(message)) {
    const std::string_view jpeg = message.substr(2 + camera->size());
    heard.pictures[std::string(*camera)] = cv::imdecode(std::vector<char>(jpeg.begin(), jpeg.end()), cv::IMREAD_COLOR);
  } else if (message.front() == static_cast<char>(FeedKind::kPoints)) {
    Batch& batch = heard.batches.emplace_back(Batch{{}, MonotonicClock::one().now()});
    std::memcpy(&batch.frame.ns, message.data() + 1, sizeof batch.frame.ns);
    for (std::size_t at = kPointsBegin; at + 12 <= message.size(); at += 12) {
      std::array<float, 3> p{};
      std::memcpy(p.data(), message.data() + at, sizeof p);
      ++heard.points;
      for (const float c : p) heard.all_finite = heard.all_finite && std::isfinite(c);
    }
  } else {
    heard.texts.push_back(json::parse(message.substr(1)));
  }
}

/// `on_text`: is told each text of the feed as it comes.
/// `late`: looks at the feed when the program has ended.
Heard run_on_terminal(std::vector<std::string> words,
                      const std::function<void(const json&, TerminalProgram&)>& on_text = {}, bool late = false) {
  words.insert(words.begin(), TANKRIG_PROGRAM);
  std::filesystem::current_path(TANKRIG_SOURCE_DIR);  // where its rigs are
  TerminalProgram program(words);
  Heard heard;
  std::string buffer(kMostFeedBytes, '\0');
  bool over = false;
  while (!over) {
    std::array<pollfd, 3> wanted{
        {{program.terminal(), POLLIN, 0}, {late ? -1 : program.feed(), POLLIN, 0}, {program.end(), POLLIN, 0}}};
    if (::poll(wanted.data(), wanted.size(), kPatience_ms) <= 0) break;
    over = wanted[2].revents != 0;
    for (ssize_t n; (n = ::read(program.terminal(), buffer.data(), buffer.size())) > 0;)
      heard.screen.append(buffer.data(), static_cast<std::size_t>(n));
    for (ssize_t n; (over || !late) && (n = ::recv(program.feed(), buffer.data(), buffer.size(), MSG_DONTWAIT)) > 0;) {
      const bool text = buffer.front() == static_cast<char>(FeedKind::kText);
      take({buffer.data(), static_cast<std::size_t>(n)}, heard);
      if (text && on_text) on_text(heard.texts.back(), program);
    }
  }
  if (over) heard.exit_code = program.exit_code();
  return heard;
}

/// Stamps [ns] of the frames in which a stripe can be.
std::set<std::int64_t> lit_frames(const Session& session) {
  const std::string mono = session.camera(CameraRole::kMono).name;
  std::set<std::int64_t> lit;
  for (const FrameRecord& frame : session.frames)
    if (frame.camera == mono && frame.laser_on) lit.insert(frame.stamp.ns);
  return lit;
}

std::set<std::int64_t> told_frames(const Heard& heard) {
  std::set<std::int64_t> told;
  for (const Batch& batch : heard.batches) told.insert(batch.frame.ns);
  return told;
}

/// Lit frames that the scan says it had no time for.
std::size_t passed_over(const std::string& screen) {
  std::smatch found;
  return std::regex_search(screen, found, std::regex("live: (\\d+) of \\d+ frames passed over")) ? std::stoul(found[1])
                                                                                                 : 0;
}

TEST(Feed, OfAScanTellsTheSceneTheSweepAndTheEnd) {
  const std::filesystem::path folder = scratch_folder();
  const Heard heard = run_on_terminal({"scan", "--rig", small_rig(folder), "--out", folder / "session"});
  ASSERT_EQ(heard.exit_code, 0) << heard.screen;
  ASSERT_EQ(heard.of("scene").size(), 1U);
  EXPECT_EQ(heard.of("scene")[0].at("object").at("triangles").size(), 12U);
  EXPECT_EQ(heard.of("scene")[0].at("cameras").size(), 3U);
  EXPECT_GT(heard.points, 1000U);
  EXPECT_TRUE(heard.all_finite);
  // All of this sweep is in the workspace.
  EXPECT_EQ(told_frames(heard), lit_frames(Session::open(folder / "session")));
  EXPECT_EQ(heard.pictures.size(), 3U);
  for (const auto& [camera, picture] : heard.pictures) EXPECT_FALSE(picture.empty()) << camera;
  bool lit = false, swept = false;
  for (const json& state : heard.of("state")) {
    lit = lit || state.value("laser", "") == "on";
    swept = swept || state.at("phase") == "sweep";
    EXPECT_TRUE(state.at("joints_deg").contains("elbow"));
    EXPECT_EQ(state.at("arm").size(), 5U);
    EXPECT_EQ(state.at("interlock_closed"), true);
    EXPECT_EQ(state.at("lost"), (json{{"left", 0}, {"mono", 0}, {"right", 0}}));
    EXPECT_FALSE(state.contains("wake_ups"));  // nothing is late under a virtual clock
  }
  EXPECT_GT(heard.of("state").back().at("lit_s").get<double>(), 1);
  ASSERT_EQ(heard.of("lux").size(), 1U);
  EXPECT_EQ(heard.of("lux")[0].at("source"), "meter");
  ASSERT_FALSE(heard.of("cameras").empty());
  const json mono = heard.of("cameras").back().at("cameras").at(1);
  EXPECT_EQ(mono.at("name"), "mono");
  EXPECT_GT(mono.at("focus").get<double>(), 0);
  EXPECT_LT(mono.at("clipped_share").get<double>(), 0.5);
  EXPECT_NEAR(mono.at("rate_hz").get<double>(), 25, 0.5);  // as the rig file has it
  EXPECT_TRUE(lit && swept);
  ASSERT_EQ(heard.of("end").size(), 1U);
  EXPECT_EQ(heard.of("end")[0].at("laser_dark"), true);
  EXPECT_EQ(heard.of("end")[0].at("arm_at_rest"), true);
  ASSERT_EQ(heard.of("scores").size(), 1U);
  const json best = heard.of("scores")[0].at("scores").at(0);
  EXPECT_EQ(best.at("method"), "laser");
  EXPECT_LT(best.at("mean_error_m").get<double>(), 0.002);
  EXPECT_GT(best.at("coverage_of_ceiling").get<double>(), 0.5);
  ASSERT_FALSE(heard.of("progress").empty());
  EXPECT_EQ(heard.of("progress").back().at("fraction"), 1.0);
}

TEST(Feed, OnTheWireBringsTheFramesPointsWithinHalfASecond) {
  constexpr Duration kWithin = std::chrono::milliseconds{500};
  constexpr Duration kBearable = std::chrono::milliseconds{50};  // and still most frames are told
  constexpr double kInTime = 0.8;  // of the frames, at least; the background waits its turn
  const std::filesystem::path folder = scratch_folder(), rig = patient_wire_rig(folder / "rig");
  edit(folder / "rig/base.yaml", {{"from_rad: 1.3\n", "from_rad: 1.5\n"}, {"to_rad: 2.1", "to_rad: 1.9"}});
  std::optional<testing_support::MachineWitness> witness;  // its threads must not be there when the program is started
  const Heard heard =
      run_on_terminal({"scan", "--rig", rig, "--yes", "--out", folder / "session"}, [&](const json&, TerminalProgram&) {
        if (!witness) witness.emplace();
      });
  if (forbids_private_network({heard.exit_code, "", heard.screen})) GTEST_SKIP() << heard.screen;
  ASSERT_TRUE(witness) << heard.screen;
  if (heard.exit_code != 0) {
    TANKRIG_SKIP_IF_LATE(*witness, testing_support::kStarved);
  }
  ASSERT_EQ(heard.exit_code, 0) << heard.screen;
  const std::set<std::int64_t> lit = lit_frames(Session::open(folder / "session")), told = told_frames(heard);
  ASSERT_FALSE(lit.empty());
  Duration latest{};
  for (const Batch& batch : heard.batches) {
    EXPECT_TRUE(lit.contains(batch.frame.ns)) << batch.frame.ns;
    EXPECT_GE(batch.came, batch.frame);
    latest = std::max(latest, batch.came - batch.frame);
  }
  // Of the machine, too, the sweep alone is judged: nothing else is timed.
  const Duration late = witness->latest(Stamp{*lit.begin()}, Stamp{*lit.rbegin()} + kWithin);
  std::printf("%zu of %zu lit frames, the latest after %.0f ms; the machine was late by %.1f ms\n", told.size(),
              lit.size(), 1e3 * seconds(latest), 1e3 * seconds(late));
  EXPECT_EQ(told.size() + passed_over(heard.screen), lit.size());
  const Duration rest = kWithin - kLatestLine;
  if (late > rest) GTEST_SKIP() << testing_support::machine_was_late(late, rest);
  EXPECT_LE(latest, kWithin);
  if (late > kBearable) GTEST_SKIP() << testing_support::machine_was_late(late, kBearable);
  EXPECT_GE(static_cast<double>(told.size()), kInTime * static_cast<double>(lit.size()));
}

TEST(Feed, KeepsWhatIsSaidOnceForAListenerThatLooksLate) {
  const std::filesystem::path folder = scratch_folder();
  const std::filesystem::path rig = small_rig(folder);
  edit(rig, {{"from_rad: 1.68", "from_rad: 1.4"}});
  const Heard heard = run_on_terminal({"scan", "--rig", rig, "--out", folder / "session"}, {}, true);
  ASSERT_EQ(heard.exit_code, 0) << heard.screen;
  for (const char* once : {"scene", "lux", "end", "scores"}) EXPECT_EQ(heard.of(once).size(), 1U) << once;
  EXPECT_LT(told_frames(heard).size(), lit_frames(Session::open(folder / "session")).size()) << "all had room";
}

TEST(Feed, OfAScanThatIsInterruptedEndsWithWhatWasConfirmed) {
  const std::filesystem::path folder = scratch_folder();
  const Heard heard = run_on_terminal({"scan", "--rig", small_rig(folder), "--out", folder / "session"},
                                      [](const json& text, TerminalProgram& program) {
                                        if (text.at("feed") == "state" && text.at("phase") == "sweep")
                                          program.interrupt();
                                      });
  EXPECT_EQ(heard.exit_code, 3) << heard.screen;
  ASSERT_EQ(heard.of("end").size(), 1U);
  EXPECT_EQ(heard.of("end")[0].at("laser_dark"), true);
  bool warned = false;
  for (const json& told : heard.of("told"))
    warned = warned ||
             (told.at("level") == "warning" && told.at("text").get<std::string>().find("stopped") != std::string::npos);
  EXPECT_TRUE(warned);
}

TEST(Feed, OfTheGuidedCalibrationShowsTheBoardsAsTheyCome) {
  const std::filesystem::path folder = scratch_folder();
  const Heard heard = run_on_terminal({"calibrate", "all", "--rig", "tank-sim", "--data", folder / "calibration"},
                                      [](const json& text, TerminalProgram& program) {
                                        if (text.at("feed") == "judged" && text.at("picture") == 3) program.interrupt();
                                      });
  const std::vector<json> boards = heard.of("judged");
  ASSERT_GE(boards.size(), 3U) << heard.screen;
  std::size_t counted = 0;
  for (const json& board : boards) {
    ASSERT_EQ(board.at("cameras").size(), 3U);
    EXPECT_EQ(board.at("target"), "board");
    EXPECT_EQ(board.at("enough"), 10);
    for (const json& camera : board.at("cameras")) {
      const bool counts = camera.at("counts");
      EXPECT_EQ(counts, camera.at("why_not").get<std::string>().empty());
      EXPECT_TRUE(!counts || std::stoi(camera.at("found").get<std::string>()) >= 6) << camera;
      counted += counts;
    }
  }
  std::size_t said = 0;
  for (const json& camera : boards.back().at("cameras")) {
    said += camera.at("pictures").get<std::size_t>();
    const cv::Mat picture = heard.pictures.at(kJudgedPicture + camera.at("name").get<std::string>());
    EXPECT_EQ(picture.channels(), 3);
  }
  EXPECT_EQ(said, counted);
  EXPECT_GT(counted, 0U);
  EXPECT_THAT(
      boards.front().at("missing").get<std::string>(),
      testing::ContainsRegex("^(0 pictures|1 picture) of the board by camera [a-z]+ counts?, expected 10: hold it"));
}

TEST(Feed, OfASweepDrawsItsCurvesAsTheyComeAndNamesItsReport) {
  const std::filesystem::path folder = scratch_folder(), file = folder / "levels.xml";
  write_text(file,
             "<benchmark><measures>" + cloud("laser") + "</measures>" + kAlways +
                 "<function>laser.coverage</function><sceneUpdater><luxUpdater><level>30</level><level>100</level>"
                 "<interval>0</interval></luxUpdater></sceneUpdater></benchmark>\n");
  const std::filesystem::path rig = small_rig(folder / "rig");
  for (const std::string command : {"bench", "experiment"}) {
    const Heard heard = run_on_terminal({command, file, "--rig", rig, "--out", folder / command});
    ASSERT_EQ(heard.exit_code, 0) << heard.screen;
    std::vector<std::string> coverage;
    for (const json& plot : heard.of("plot"))
      if (plot.at("plot") == "coverage") coverage.push_back(plot.at("svg"));
    ASSERT_GE(coverage.size(), 2U);
    EXPECT_TRUE(coverage.front().starts_with("<svg"));
    EXPECT_LT(coverage.front().size(), coverage.back().size()) << "one level, then both";
    ASSERT_EQ(heard.of("report").size(), 1U);
    EXPECT_TRUE(std::filesystem::exists(heard.of("report")[0].at("file").get<std::string>()));
  }
}

TEST(Feed, IsNotMissedWhereNobodyListens) {
  ::setenv(kFeedVariable, "0", 1);  // no socket
  EXPECT_EQ(run_tankrig({"arm", "status"}).exit_code, 0);
  ::setenv(kFeedVariable, "rubbish", 1);
  EXPECT_EQ(run_tankrig({"arm", "status"}).exit_code, 0);
  ::unsetenv(kFeedVariable);
}

TEST(ArmOnATerminal, MovesWithoutAKeyWhereNobodyCanBeHurt) {
  const Heard heard = run_on_terminal({"arm", "jog", "elbow", "1", "--relative"});
  EXPECT_EQ(heard.exit_code, 0) << heard.screen;
  ASSERT_EQ(heard.of("keys").size(), 1U);
  EXPECT_EQ(heard.of("keys")[0].at("hold_to_run"), false);
  EXPECT_THAT(heard.screen, HasSubstr("complete"));
}

}  // namespace
}  // namespace tankrig::test
