// Small scans as a laboratory meets them: with faults, killed, calibrated from, and recorded by an older program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <csignal>
#include <regex>
#include <thread>

#include "session/reading/session.hpp"
#include "tests/program/program.hpp"
#include "tests/support/machine_witness.hpp"

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::StartsWith;

namespace tankrig::test {
namespace {

fs::path small_rig(const Edits& edits = {}) { return test::small_rig(scratch_folder() / "rig", edits); }

/// A scan that gets `signal` at the first line of its screen that begins with `words`.
ProgramRun scan_until(const std::string& words, int signal, const fs::path& rig, const fs::path& out) {
  bool sent = false;
  const ProgramRun run =
      run_tankrig({"scan", "--rig", rig.string(), "--out", out.string()}, [&](const std::string& line, int pid) {
        if (!sent && line.starts_with(words)) sent = kill(pid, signal) == 0;
      });
  EXPECT_TRUE(sent) << run.err;
  return run;
}

/// Killed at these words.
void kill_scan_at(const std::string& words, const fs::path& session) {
  EXPECT_EQ(scan_until(words, SIGKILL, small_rig(), session).exit_code, 128 + SIGKILL);
}

constexpr Duration kUntilSealed = std::chrono::milliseconds{50};  // a scan writes its pictures for longer than that

/// Recorded and sealed, without clouds.
ProgramRun recorded(const fs::path& rig, const fs::path& out) {
  ProgramRun run = scan_until("reconstruct: laser", SIGINT, rig, out);
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_THAT(run.err, HasSubstr("the scan is complete"));
  return run;
}

/// "mono 27": those that the session holds.
std::string frames_of(const std::string& camera, const Session& session) {
  return camera + ' ' + std::to_string(std::ranges::count(session.frames, camera, &FrameRecord::camera));
}

int check(const fs::path& session) { return run_tankrig({"session", "check", session.string()}).exit_code; }

void expect_one_line(const ProgramRun& run, const std::vector<std::string>& words) {
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  for (const std::string& word : words) EXPECT_THAT(run.err, HasSubstr(word));
}

TEST(CalibrateTime, FindsAnInjectedOffsetAndKeepsTheSessionWhole) {
  const fs::path session = scratch_folder() / "session";
  const fs::path rig = small_rig({{"from_rad: 1.68", "from_rad: 1.66"}, {"passes: 1", "passes: 2"}});
  write_text(rig, read_text(rig) + "\nmock:\n  camera: {stamp_offset_ms: 20}\n");
  recorded(rig, session);
  const ProgramRun run = run_tankrig({"calibrate", "time", session.string(), "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NEAR(run.json().at("time_offset_s").get<double>(), 0.020, 0.001);
  const auto interval = run.json().at("interval_95_s").get<std::array<double, 2>>();
  EXPECT_LT(interval[0], 0.020);
  EXPECT_GT(interval[1], 0.020);
  EXPECT_LT(interval[1] - interval[0], 0.004);  // 0.1 rad tell no more
  EXPECT_LT(run.json().at("sigma_s").get<double>(), 0.0005);
  EXPECT_LT(run.json().at("clouds_after").at("median_mm").get<double>(), 1);
  EXPECT_THAT(read_text(session / "results" / "time_offset.yaml"), HasSubstr("time_offset_s: 0.0"));
  EXPECT_EQ(check(session), 0);
}

TEST(Faults, ALostBeamTakesTheLaserOffFirstAndTheSessionSaysSo) {
  const fs::path plan = scratch_folder() / "plan.yaml", session = scratch_folder() / "session";
  write_text(plan,
             "faults:\n  - {device: beam, kind: off, from: laser_on, at_s: 1}\n"
             "  - {device: arm, kind: off, phase: sweep pass 7}\n");
  const ProgramRun run =
      run_tankrig({"scan", "--rig", small_rig().string(), "--faults", plan.string(), "--out", session.string()});
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_THAT(run.err, HasSubstr("beam not seen"));
  EXPECT_THAT(run.err, HasSubstr("laser off, arm at rest"));
  EXPECT_THAT(run.err, HasSubstr("faults: arm: off: never began"));
  EXPECT_THAT(run.err, testing::Not(HasSubstr("move to park")));  // not a phase of the plan after its end
  EXPECT_THAT(Session::open(session).info.status, StartsWith("stopped: beam not seen"));
  const std::string events = read_text(session / "events.csv");
  const std::size_t begins = events.find(",injected,beam: off begins"), off = events.find(",laser,off"),
                    fault = events.find(",fault,");
  ASSERT_NE(fault, std::string::npos) << events;
  EXPECT_LT(begins, off);
  EXPECT_LT(off, fault);
  EXPECT_THAT(read_text(session / "faults.yaml"), HasSubstr("device: beam, kind: off, from: laser_on, at_s: 1"));
  EXPECT_EQ(check(session), 0);
}

TEST(Faults, AFullDiskEndsTheScanSafelyAndTheSessionSaysWhy) {
  const fs::path plan = scratch_folder() / "plan.yaml", session = scratch_folder() / "session";
  write_text(plan, "faults:\n  - {device: disk, kind: disk_full, from: laser_on, at_s: 1.2}\n");
  const ProgramRun run =
      run_tankrig({"scan", "--rig", small_rig().string(), "--faults", plan.string(), "--out", session.string()});
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_THAT(run.err, HasSubstr("No space left on device; laser off, arm at rest"));
  EXPECT_THAT(Session::open(session).info.status, HasSubstr("No space left on device"));
}

TEST(Faults, FramesThatACameraLosesAreToldOnTheTerminalAsTheAccountHasThem) {
  const fs::path plan = scratch_folder() / "plan.yaml", path = scratch_folder() / "session";
  write_text(plan, "faults:\n  - {device: camera mono, kind: dropped, ratio: 0.05, seed: 1}\n");
  const ProgramRun run =
      run_tankrig({"scan", "--rig", small_rig().string(), "--faults", plan.string(), "--out", path.string(), "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Session session = Session::open(path);
  const nlohmann::json mono = run.json().at("cameras").at("mono");
  const auto number = [](const nlohmann::json& from, const char* key) { return from.value(key, std::uint64_t{0}); };
  const std::uint64_t recorded = number(mono, "recorded"), lost = number(mono.at("left_out"), "lost");
  EXPECT_GT(lost, 0u);
  EXPECT_EQ(frames_of("mono", session), "mono " + std::to_string(recorded));
  EXPECT_EQ(number(mono, "expected"), recorded + lost + number(mono.at("left_out"), "not_recorded"));
  EXPECT_EQ(mono.at("unaccounted"), 0);
  EXPECT_THAT(run.err, HasSubstr("camera mono: " + std::to_string(recorded) + " of " + std::to_string(recorded + lost) +
                                 " frames recorded: lost " + std::to_string(lost) + "\n"));
  EXPECT_THAT(run.err, HasSubstr("frames recorded, none lost: " + frames_of("left", session) + ", " +
                                 frames_of("right", session) + "\n"));
}

TEST(Faults, ABadPlanIsOneLineBeforeAnythingBegins) {
  const fs::path plan = scratch_folder() / "plan.yaml", out = scratch_folder() / "session";
  const auto scanned = [&](const char* rig, const std::string& fault) {
    write_text(plan, "faults:\n  - {" + fault + "}\n");
    return run_tankrig({"scan", "--rig", rig, "--faults", plan.string(), "--out", out.string()});
  };
  expect_one_line(scanned("tank-sim", "device: toaster, kind: off"), {"plan.yaml:2", "'toaster'", "expected one of"});
  expect_one_line(scanned("tank-sim", "device: arm, kind: off, at_s: soon"), {"plan.yaml:2", "at_s", "'soon'"});
  expect_one_line(scanned("tank-sim", "device: camera top, kind: off"), {"plan.yaml", "'top'", "mono, left, right"});
  expect_one_line(scanned("tank-wire", "device: arm, kind: clock_jump"), {"plan.yaml", "clock_jump", "emulated wire"});
  expect_one_line(scanned("tank-wire", "device: arm, kind: off, phase: sweep"), {"plan.yaml", "no phases"});
  EXPECT_FALSE(fs::exists(out));
}

TEST(Killed, WhileItsPicturesAreWrittenAScanLosesNothing) {
  const fs::path session = scratch_folder() / "session";
  const testing_support::MachineWitness witness;
  kill_scan_at("writing pictures", session);
  if (fs::exists(session / "SHA256SUMS")) {
    TANKRIG_SKIP_IF_LATE(witness, kUntilSealed);
    FAIL() << "sealed before it was killed";
  }
  const ProgramRun before = run_tankrig({"session", "check", session.string(), "--json"});
  EXPECT_EQ(before.exit_code, 3) << before.out;
  EXPECT_TRUE(before.json().at("losses").empty()) << before.out;
  EXPECT_EQ(run_tankrig({"session", "recover", session.string()}).exit_code, 0);
  EXPECT_EQ(check(session), 0);
  const Session mended = Session::open(session);
  EXPECT_EQ(mended.info.status, "complete");
  EXPECT_EQ(mended.frames.size(), before.json().at("frames").get<std::size_t>());
}

TEST(Killed, InItsSweepAScanIsRecoveredWithItsLossesListed) {
  const fs::path session = scratch_folder() / "session", copy = scratch_folder() / "recovered";
  const testing_support::MachineWitness witness;
  kill_scan_at("scan: sweep", session);
  if (fs::exists(session / "SHA256SUMS")) {
    TANKRIG_SKIP_IF_LATE(witness, kUntilSealed);
    FAIL() << "sealed before it was killed";
  }
  EXPECT_EQ(check(session), 3);
  EXPECT_EQ(run_tankrig({"session", "recover", session.string(), "--out", copy.string()}).exit_code, 0);
  EXPECT_EQ(check(session), 3) << "a copy was asked for";
  EXPECT_EQ(check(copy), 0);
  EXPECT_THAT(Session::open(copy).info.status, StartsWith("stopped: recovered"));
  EXPECT_EQ(check(scratch_folder() / "nothing"), 1);
}

/// A small scan that is killed as soon as there is `file` in its session.
ProgramRun scan_killed_at_file(const std::string& file, const fs::path& session) {
  std::jthread watcher;
  return run_tankrig({"scan", "--rig", small_rig().string(), "--out", session.string()},
                     [&](const std::string&, int pid) {
                       if (watcher.joinable()) return;
                       watcher = std::jthread([=](const std::stop_token& over) {
                         MonotonicClock clock;
                         while (!over.stop_requested() && !fs::exists(session / file))
                           clock.sleep_until(clock.now() + std::chrono::milliseconds{1});
                         if (!over.stop_requested()) kill(pid, SIGKILL);
                       });
                     });
}

class KilledAfterItsSeal : public testing::TestWithParam<const char*> {};

/// What was made of the recording can be made again.
TEST_P(KilledAfterItsSeal, AScanHasLostNothing) {
  const fs::path session = scratch_folder() / "session";
  const testing_support::MachineWitness witness;
  const ProgramRun run = scan_killed_at_file(GetParam(), session);
  if (run.exit_code != 128 + SIGKILL) {
    TANKRIG_SKIP_IF_LATE(witness, kUntilSealed);
    FAIL() << "ended before it was killed: " << run.err;
  }
  const ProgramRun checked = run_tankrig({"session", "check", session.string(), "--json"});
  const nlohmann::json found = checked.json();
  std::printf("killed at %s: %s, %s\n", GetParam(), found.at("verdict").dump().c_str(),
              found.at("undone").dump().c_str());
  EXPECT_EQ(found.at("status"), "complete");
  for (const char* list : {"losses", "extra", "missing"}) EXPECT_TRUE(found.at(list).empty()) << list << checked.out;
  EXPECT_EQ(found.at("verdict"), found.at("undone").empty() ? "whole" : "not finished");
  EXPECT_EQ(checked.exit_code, found.at("undone").empty() ? 0 : 3);
  for (const std::string undone : found.at("undone")) EXPECT_THAT(undone, HasSubstr("not sealed yet"));
  EXPECT_EQ(run_tankrig({"session", "recover", session.string()}).exit_code, 0);
  const ProgramRun mended = run_tankrig({"session", "check", session.string(), "--json"});
  EXPECT_EQ(mended.exit_code, 0) << mended.out;
  EXPECT_EQ(mended.json().at("frames"), found.at("frames"));
  EXPECT_TRUE(mended.json().at("recovered").empty()) << mended.out;
}

INSTANTIATE_TEST_SUITE_P(AtAFile, KilledAfterItsSeal,
                         testing::Values("SHA256SUMS", "clouds/laser.ply", "results/laser.json", "pictures/rig.png"),
                         [](const auto& file) {
                           std::string name = file.param;
                           std::erase_if(name, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); });
                           return name;
                         });

/// The table without that column.
std::string without_column(const std::string& table, const std::string& name) {
  const std::string head = table.substr(0, table.find("," + name + ","));
  const auto column = std::count(head.begin(), head.end(), ',') + 1;
  std::istringstream lines(table);
  std::string out;
  for (std::string line; std::getline(lines, line); out += line + "\n") {
    std::size_t at = 0;
    for (auto i = column; i > 0; --i) at = line.find(',', at) + 1;
    line.erase(at, line.find(',', at) + 1 - at);
  }
  return out;
}

/// Without the keys, the table's columns and the plan that sessions have had since they can be checked and replayed.
void make_old(const fs::path& session) {
  std::string yaml = read_text(session / "session.yaml");
  yaml = std::regex_replace(yaml, std::regex("\n(clock|tables|devices):.*(\n +.*)*"), "");
  yaml = std::regex_replace(yaml, std::regex("\n +time_offset_s:.*"), "");
  write_text(session / "session.yaml", yaml);
  const std::string frames = without_column(read_text(session / "frames.csv"), "stamp_sigma_ns");
  write_text(session / "frames.csv", without_column(frames, "sync_residual_mm"));
  fs::remove(session / "plan.csv");
  fs::remove(session / "SHA256SUMS");
}

TEST(OlderSessions, AreStillReadAndAOnePassSessionIsNoTimeCalibration) {
  const fs::path session = scratch_folder() / "session";
  const ProgramRun clean = recorded(small_rig(), session);
  const Session now = Session::open(session);
  EXPECT_THAT(clean.err, HasSubstr("frames recorded, none lost: " + frames_of("left", now) + ", " +
                                   frames_of("mono", now) + ", " + frames_of("right", now) + "\n"));
  EXPECT_THAT(clean.err, testing::Not(HasSubstr("camera mono: ")));
  expect_one_line(run_tankrig({"calibrate", "time", session.string()}),
                  {session.string(), "found 1 pass", "passes: 2"});
  make_old(session);
  const Session old = Session::open(session);
  ASSERT_EQ(old.frames.size(), now.frames.size());
  EXPECT_EQ(old.frames.back().q, now.frames.back().q);
  EXPECT_EQ(old.frames.back().file, now.frames.back().file);
  EXPECT_EQ(run_tankrig({"session", "info", session.string()}).exit_code, 0);
  const ProgramRun checked = run_tankrig({"session", "check", session.string(), "--json"});
  EXPECT_EQ(checked.exit_code, 3) << "never sealed";
  EXPECT_TRUE(checked.json().at("losses").empty()) << checked.out;
  EXPECT_EQ(run_tankrig({"reconstruct", session.string(), "--method", "laser"}).exit_code, 0);
  const ProgramRun replayed = run_tankrig({"session", "replay", session.string()});
  EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
  EXPECT_THAT(replayed.out, HasSubstr("without plan.csv"));
}

}  // namespace
}  // namespace tankrig::test
