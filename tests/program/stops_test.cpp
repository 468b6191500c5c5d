// Every way an operator has out of a lit sweep, with the program on a terminal and the wires of real devices.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstring>
#include <fstream>
#include <functional>
#include <future>
#include <map>

#include "drivers/arm/can_arm_link.hpp"
#include "drivers/can/can_log.hpp"
#include "sim_backends/wire/relay_emulator.hpp"
#include "tests/program/benchmark_text.hpp"
#include "tests/program/program.hpp"
#include "tests/support/frozen_thread.hpp"
#include "tests/support/named_thread.hpp"

namespace fs = std::filesystem;
using testing::HasSubstr;

namespace tankrig::test {
namespace {

using namespace std::chrono_literals;
using testing_support::FrozenThread;

/// What the cameras see is of no matter here: a quarter of their width and height, which a build with sanitizers
/// renders in time.
void take_small_pictures(const fs::path& folder) {
  const std::string mono = "width_px: 720, height_px: 576, fx_px: 626.08, fy_px: 682.78, cx_px: 368.93, cy_px: 284.83";
  const std::string eye = "width_px: 640, height_px: 480, fx_px: 765.4, fy_px: 762.9, cx_px: 315.7, cy_px: 236.8";
  const std::string small = "width_px: 160, height_px: 120, fx_px: 191, fy_px: 191, cx_px: 79.5, cy_px: 59.5";
  edit(folder / "base.yaml", {{mono, small}, {eye, small}, {eye, small}});
  const std::string size = "<resw>160</resw><resh>120</resh>", eyes = "<resw>640</resw><resh>480</resh>";
  edit(folder / "tank.xml", {{"<resw>720</resw><resh>576</resh>", size}, {eyes, size}, {eyes, size}});
  const std::string optics = "<fx>191</fx><fy>191</fy><x0>79.5</x0><y0>59.5</y0>";
  const std::string eyes_optics = "<fx>765.4</fx><fy>762.9</fy><x0>315.7</x0><y0>236.8</y0>";
  edit(folder / "tank.xml", {{"<fx>626.08</fx><fy>682.78</fy><x0>368.93</x0><y0>284.83</y0>", optics},
                             {eyes_optics, optics},
                             {eyes_optics, optics}});
}

/// Soon in its sweep; its laser is a box of this process.
fs::path wire_rig(const fs::path& folder) {
  const fs::path rig = patient_wire_rig(
      folder, {{"\nscan:\n", "\nscan:\n  park_rad: [0, 0.13, 1.3, 0, 0.1]\n  dark_frames: 2\n"},
               {"  safety:\n", "  safety:\n    beam: {verify: false}\n"},  // the cameras know nothing of the box
               {"cycle_hz: 350", "cycle_hz: 100"},
               {"exchange_rate_hz: 350", "exchange_rate_hz: 100"},
               {"device: runtime/laser", "device: " + (folder / "laser").string()},
               {"power_up_rad: [0, 0.13, 0.9", "power_up_rad: [0, 0.13, 1.3"}});
  take_small_pictures(folder);
  return rig;
}

/// The program on a terminal of its own.
struct OnTerminal {
  MonotonicClock clock;
  int terminal = -1;
  pid_t process = -1;
  std::string screen;
  int status = 0;

  void run(std::vector<std::string> words) {
    words.insert(words.begin(), "tankrig");
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const std::string source = TANKRIG_SOURCE_DIR;
    terminal = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);  // nobody else's, so that its closing is a hang-up
    std::array<char, 64> own{};
    EXPECT_TRUE(::grantpt(terminal) == 0 && ::unlockpt(terminal) == 0 &&
                ::ptsname_r(terminal, own.data(), own.size()) == 0);
    process = ::fork();
    if (process == 0) {
      ::setsid();
      const int end = ::open(own.data(), O_RDWR);
      ::ioctl(end, TIOCSCTTY, 0);
      for (const int standard : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(end, standard);
      if (::chdir(source.c_str()) != 0) ::_exit(126);
      ::execv(TANKRIG_PROGRAM, argv.data());
      ::_exit(127);
    }
  }
  OnTerminal() = default;
  ~OnTerminal() {
    hang_up();
    if (process > 0) {
      ::kill(process, SIGKILL);
      ::waitpid(process, nullptr, 0);
    }
  }
  OnTerminal(const OnTerminal&) = delete;
  OnTerminal& operator=(const OnTerminal&) = delete;

  void press(char key) { EXPECT_EQ(::write(terminal, &key, 1), 1); }
  void signal(int number) { EXPECT_EQ(::kill(process, number), 0); }
  void hang_up() {
    if (terminal >= 0) ::close(terminal);
    terminal = -1;
  }

  /// Reads the screen until `condition` holds; false at the end of the program, or after a minute.
  bool until(const std::function<bool()>& condition) {
    for (const Stamp end = clock.now() + 60s; clock.now() < end;) {
      if (condition()) return true;
      if (::waitpid(process, &status, WNOHANG) == process) {
        read_screen();
        process = -1;
        return condition();
      }
      read_screen();
    }
    return false;
  }
  bool shows(const std::string& text) {
    return until([&] { return screen.find(text) != std::string::npos; });
  }
  bool ended() {
    return until([this] { return process < 0; });
  }

 private:
  void read_screen() {
    pollfd door{terminal, POLLIN, 0};
    if (::poll(&door, 1, 10) <= 0 || !(door.revents & POLLIN)) return;
    char text[4096];
    if (const ssize_t n = ::read(terminal, text, sizeof text); n > 0) screen.append(text, static_cast<std::size_t>(n));
  }
};

/// A scan of the rig in `where`.
struct Scan : OnTerminal {
  fs::path folder;
  sim::MockLaser lamp{200ms, clock};
  sim::RelayEmulator box;

  explicit Scan(const fs::path& where)
      : folder(where), box({.name = where / "laser", .protocol = {.status_query = 3}, .watchdog = 0s}, lamp) {
    run({"scan", "--rig", folder / "rig.yaml", "--out", session()});
  }
  fs::path session() const { return folder / "session"; }
  bool lit() {
    return until([this] { return box.relay_closed() && screen.find("scan: sweep") != std::string::npos; });
  }
};

/// As the last demands on the bus say.
bool arm_at_rest(const fs::path& session) {
  std::map<canid_t, SlotBytes> newest;
  const ArmCanIds ids;
  for (const CanLogEntry& entry : read_can_log(session / "can.log").entries)
    if (std::find(ids.demand.begin(), ids.demand.end(), entry.frame.can_id) != ids.demand.end())
      std::copy_n(entry.frame.data, 8, newest[entry.frame.can_id].begin());
  return newest.size() == kJoints && std::all_of(newest.begin(), newest.end(), [](const auto& demand) {
           return decode_demand(demand.second).type == DemandType::kStop;
         });
}

struct WayOut {
  std::string name;
  std::function<void(Scan&)> take;
};

std::vector<WayOut> ways_out() {
  const auto by = [](int number) { return [number](Scan& scan) { scan.signal(number); }; };
  return {{"stop key", [](Scan& scan) { scan.press(' '); }},
          {"held Ctrl-C",
           [](Scan& scan) {
             scan.until([&] {
               scan.press('\x03');
               return scan.process < 0;
             });
           }},
          {"Ctrl-Z", [](Scan& scan) { scan.press('\x1a'); }},
          {"closed terminal", [](Scan& scan) { scan.hang_up(); }},
          {"TERM", by(SIGTERM)},
          {"HUP", by(SIGHUP)},
          {"QUIT", by(SIGQUIT)},
          {"USR1", by(SIGUSR1)},
          {"real-time signal", by(SIGRTMAX)},
          {"INT, then TERM", [](Scan& scan) {
             scan.signal(SIGINT);
             scan.signal(SIGTERM);
           }}};
}

/// Signals by what the kernel says that the process does with them: "SigCgt", "SigIgn".
bool does(pid_t process, const char* what, int signal) {
  std::ifstream file("/proc/" + std::to_string(process) + "/status");
  for (std::string word; file >> word;)
    if (word == std::string(what) + ":" && file >> word)
      return (std::stoull(word, nullptr, 16) >> (signal - 1) & 1U) != 0;
  return false;
}

const std::string& forbidden() {
  static const std::string reason = [] {
    const ProgramRun run = run_tankrig({"emulate", "--rig", "tank-wire", "--device", "cameras", "--", "true"});
    return forbids_private_network(run) ? run.err : std::string();
  }();
  return reason;
}

std::string left_by(const WayOut& way, const fs::path& folder) {
  Scan scan(folder);
  if (!scan.lit()) return "never lit: " + scan.screen;
  way.take(scan);
  if (!scan.ended()) return "does not end";
  std::string wrong;
  const auto expect = [&](bool well, const std::string& what) { wrong += well ? "" : what + "; "; };
  expect(WIFEXITED(scan.status) && WEXITSTATUS(scan.status) == 3, "status " + std::to_string(scan.status));
  expect(!scan.box.relay_closed(), "relay closed");
  expect(scan.terminal < 0 || scan.screen.find("laser off, arm at rest") != std::string::npos, "does not tell");
  expect(arm_at_rest(scan.session()), "arm driven");
  expect(read_text(scan.session() / "session.yaml").find("stopped") != std::string::npos, "session not closed");
  return wrong.empty() ? wrong : wrong + scan.screen;
}

TEST(WaysOut, EndEachInDarkAndRestWithCodeThreeAndAReadableSession) {
  if (!forbidden().empty()) GTEST_SKIP() << forbidden();
  constexpr std::size_t kAtOnce = 3;
  const std::vector<WayOut> ways = ways_out();
  const fs::path folder = scratch_folder();
  for (std::size_t begin = 0; begin < ways.size(); begin += kAtOnce) {
    std::vector<std::future<std::string>> outcomes;
    for (std::size_t i = begin; i < std::min(begin + kAtOnce, ways.size()); ++i)
      outcomes.push_back(
          std::async(std::launch::async, left_by, ways[i], wire_rig(folder / std::to_string(i)).parent_path()));
    for (std::size_t i = 0; i < outcomes.size(); ++i) {
      EXPECT_EQ(outcomes[i].get(), "") << ways[begin + i].name;
      EXPECT_EQ(run_tankrig({"session", "info", (folder / std::to_string(begin + i) / "session").string()}).exit_code,
                0);
    }
  }
}

TEST(WaysOut, AreAllSignalsThatCanBeCaughtAndTheThirdEndsTheProgramInTheDark) {
  if (!forbidden().empty()) GTEST_SKIP() << forbidden();
  Scan scan(wire_rig(scratch_folder() / "rig").parent_path());
  ASSERT_TRUE(scan.lit()) << scan.screen;
  for (int signal = 1; signal <= SIGRTMAX; ++signal) {
    const auto is = [signal](std::initializer_list<int> some) {
      return std::find(some.begin(), some.end(), signal) != some.end();
    };
    if (is({SIGKILL, SIGSTOP, SIGCHLD, SIGCONT, SIGURG, SIGWINCH, 32, 33}))
      continue;  // end nothing, or nobody's to catch
    const bool ignored = is({SIGPIPE, SIGXFSZ});
    EXPECT_TRUE(does(scan.process, ignored ? "SigIgn" : "SigCgt", signal)) << ::strsignal(signal);
  }
  for (const int signal : {SIGINT, SIGTERM, SIGUSR1}) scan.signal(signal);
  ASSERT_TRUE(scan.ended());
  ASSERT_TRUE(WIFSIGNALED(scan.status)) << scan.status;
  EXPECT_THAT(WTERMSIG(scan.status), testing::AnyOf(SIGINT, SIGTERM, SIGUSR1));
  EXPECT_TRUE(scan.until([&] { return !scan.box.relay_closed(); }));
  EXPECT_TRUE(scan.box.off_since());
  termios mode{};
  EXPECT_TRUE(::tcgetattr(scan.terminal, &mode) == 0 && (mode.c_lflag & ICANON) && (mode.c_lflag & ECHO));
}

TEST(WaysOut, AreOpenAlsoWhileTheEmulatedDevicesStart) {
  if (!forbidden().empty()) GTEST_SKIP() << forbidden();
  Scan scan(patient_wire_rig(scratch_folder() / "rig").parent_path());
  ASSERT_TRUE(scan.until([&] { return does(scan.process, "SigCgt", SIGTERM); })) << scan.screen;
  scan.signal(SIGTERM);
  ASSERT_TRUE(scan.ended());
  EXPECT_TRUE(WIFEXITED(scan.status) && WEXITSTATUS(scan.status) == 3) << scan.status;
  EXPECT_THAT(scan.screen, HasSubstr("tankrig: stopped while the emulated devices started: nothing moved"));
  EXPECT_FALSE(fs::exists(scan.session()));
}

/// A rig file that does not say that its devices are emulated: to the program they are real.
fs::path real_to_the_program(const fs::path& folder) {
  const fs::path rig = patient_wire_rig(folder);
  const std::string text = read_text(rig);
  write_text(rig, text.substr(0, text.find("\n# How the emulated devices behave")) + "\n");
  return rig;
}

TEST(HeldToRun, AJogOnDevicesAsksWarnsAndMovesWhileAKeyIsHeld) {
  const fs::path served = patient_wire_rig(scratch_folder() / "served"),
                 rig = real_to_the_program(scratch_folder() / "real");
  OnTerminal jog;
  jog.run({"emulate", "--rig", served, "--device", "arm", "--device", "laser", "--", "tankrig", "arm", "jog", "--rig",
           rig, "elbow", "80", "--waive", "commission"});
  ASSERT_TRUE(jog.shows("[y/N]")) << jog.screen;
  EXPECT_THAT(jog.screen, HasSubstr("its arm will move for 6 s (elbow 51.6 to 80.0 deg)"));
  jog.press('y');
  jog.press('\n');
  ASSERT_TRUE(jog.shows("starts in 1 s")) << jog.screen;
  ASSERT_TRUE(jog.shows("hold space")) << jog.screen;
  const auto moving = [&] { return jog.screen.find("arm: move elbow") != std::string::npos; };
  EXPECT_FALSE(moving());
  ASSERT_TRUE(jog.until([&] {
    jog.press(' ');
    return moving();
  })) << jog.screen;
  ASSERT_TRUE(jog.ended()) << jog.screen;
  EXPECT_TRUE(WIFEXITED(jog.status) && WEXITSTATUS(jog.status) == 3) << jog.status << jog.screen;
  EXPECT_THAT(jog.screen, HasSubstr("arm stopped: asked for; laser off, arm at rest"));
}

TEST(ATypedLightLevel, IsAskedForUntilItHoldsAndAStopThereMovesNothing) {
  const fs::path rig = real_to_the_program(scratch_folder() / "real"), out = scratch_folder() / "out";
  edit(rig, {{"\nscan:\n", "\nscan:\n  read_lux: false\n"}});
  edit(rig.parent_path() / "base.yaml", {{"\nscene: tank.xml", ""}});
  const fs::path file = scratch_folder() / "level.xml";
  write_text(file, "<benchmark><measures>" + cloud("laser") + "</measures>" + kAlways +
                       "<function>laser.coverage</function><sceneUpdater><luxUpdater><level>147</level>"
                       "<interval>0</interval></luxUpdater></sceneUpdater></benchmark>\n");
  const std::vector<std::string> command{"experiment", file, "--rig", rig, "--out", out};
  OnTerminal experiment;
  experiment.run(command);
  const auto type = [&](const std::string& line) {
    for (const char key : line) experiment.press(key);
  };
  ASSERT_TRUE(experiment.shows("Set the light to 147 lx")) << experiment.screen;
  type("dim\n");
  ASSERT_TRUE(experiment.shows("expected a number")) << experiment.screen;
  type("20\n");
  ASSERT_TRUE(experiment.shows("found 20, expected 147 lx")) << experiment.screen;
  type("\x03");
  ASSERT_TRUE(experiment.ended()) << experiment.screen;
  EXPECT_TRUE(WIFEXITED(experiment.status) && WEXITSTATUS(experiment.status) == 3) << experiment.screen;
  EXPECT_THAT(experiment.screen, HasSubstr("stopped before the light was set: nothing moved"));
  EXPECT_FALSE(fs::exists(out / "sessions"));
}

/// The cycle of a lit sweep hangs.
struct Hanging {
  Scan scan;
  FrozenThread cycle;
  explicit Hanging(const fs::path& folder) : scan(wire_rig(folder).parent_path()) {
    if (scan.lit()) cycle.freeze(scan.process, "tankrig-cycle");
  }
};

TEST(WaysOut, ACycleThatHangsIsToldAndLeavesItInTheDarkAtRestWithAReadableSession) {
  if (!forbidden().empty()) GTEST_SKIP() << forbidden();
  Hanging hung(scratch_folder() / "rig");
  if (hung.cycle.forbidden()) GTEST_SKIP() << "this machine does not let a parent trace its child";
  ASSERT_TRUE(hung.cycle.frozen()) << hung.scan.screen;
  ASSERT_TRUE(hung.scan.until([&] { return !hung.scan.box.relay_closed(); }));
  ASSERT_TRUE(hung.scan.until([&] { return hung.cycle.gone() && hung.scan.process < 0; })) << hung.scan.screen;
  EXPECT_TRUE(WIFEXITED(hung.scan.status) && WEXITSTATUS(hung.scan.status) == 3) << hung.scan.status;
  EXPECT_THAT(hung.scan.screen, HasSubstr("cycle: hangs: no step for 1 s; laser switched off and arm stopped past it"));
  EXPECT_THAT(hung.scan.screen, HasSubstr("scan stopped: cycle: hangs: no step for 1 s; LASER MAY BE ON"));
  EXPECT_TRUE(arm_at_rest(hung.scan.session()));
  EXPECT_EQ(run_tankrig({"session", "info", hung.scan.session().string()}).exit_code, 0);
}

TEST(WaysOut, TheThirdSignalEndsAlsoAProgramWhoseCycleHangs) {
  if (!forbidden().empty()) GTEST_SKIP() << forbidden();
  Hanging hung(scratch_folder() / "rig");
  if (hung.cycle.forbidden()) GTEST_SKIP() << "this machine does not let a parent trace its child";
  ASSERT_TRUE(hung.cycle.frozen()) << hung.scan.screen;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) hung.scan.signal(signal);
  ASSERT_TRUE(hung.scan.until([&] { return hung.cycle.gone() && hung.scan.process < 0; })) << hung.scan.screen;
  ASSERT_TRUE(WIFSIGNALED(hung.scan.status)) << hung.scan.status;
  EXPECT_THAT(WTERMSIG(hung.scan.status), testing::AnyOf(SIGINT, SIGTERM, SIGHUP));
  EXPECT_TRUE(hung.scan.until([&] { return !hung.scan.box.relay_closed(); }));
}

/// The arm's end of the wire dies; the laser's box is this process's, and goes dark.
TEST(WaysOut, AnArmThatAStopDoesNotReachIsToldOfAtOnceAgainAndAtTheEnd) {
  if (!forbidden().empty()) GTEST_SKIP() << forbidden();
  Scan scan(wire_rig(scratch_folder() / "rig").parent_path());
  ASSERT_TRUE(scan.lit()) << scan.screen;
  const pid_t emulator = testing_support::child_of(scan.process);
  ASSERT_GT(emulator, 0);
  ASSERT_EQ(::kill(emulator, SIGKILL), 0);
  ASSERT_TRUE(scan.ended()) << scan.screen;
  const std::string& screen = scan.screen;
  const std::string cry = "ARM MAY BE MOVING: cut its power";
  const std::size_t first = screen.find(cry), again = screen.find("still: " + cry),
                    given_up = screen.find("laser off; ARM MAY BE MOVING"),
                    end = screen.find("the program ends, and it is not confirmed: ARM MAY BE MOVING");
  EXPECT_LT(first + cry.size(), again) << "the first is not the repetition: " << screen;
  EXPECT_LT(first, given_up) << screen;
  EXPECT_LT(given_up, end) << screen;
  EXPECT_LT(again, end) << screen;
  EXPECT_NE(end, std::string::npos) << screen;
  EXPECT_TRUE(WIFEXITED(scan.status) && WEXITSTATUS(scan.status) == 3) << scan.status;
  EXPECT_FALSE(scan.box.relay_closed());
}

/// The arm lives: that it rests says nothing of the laser.
TEST(WaysOut, ALaserThatIsUnpluggedInTheSweepIsCriedForUntilTheEnd) {
  if (!forbidden().empty()) GTEST_SKIP() << forbidden();
  Scan scan(wire_rig(scratch_folder() / "rig").parent_path());
  ASSERT_TRUE(scan.lit()) << scan.screen;
  scan.box.unplug();
  ASSERT_TRUE(scan.ended()) << scan.screen;
  EXPECT_THAT(scan.screen, HasSubstr("LASER MAY BE ON: cut its supply; arm at rest"));
  EXPECT_THAT(scan.screen, HasSubstr("the program ends, and it is not confirmed: LASER MAY BE ON: cut its supply"));
  EXPECT_THAT(scan.screen, testing::Not(HasSubstr("confirmed now")));
  EXPECT_TRUE(WIFEXITED(scan.status) && WEXITSTATUS(scan.status) == 3) << scan.status;
}

TEST(WaysOut, AFileThatMayNotGrowEndsTheScanInsteadOfTheProgram) {
  const fs::path rig = edited_rig(scratch_folder() / "rig", "dark_frames: 10", "dark_frames: 2");
  const fs::path session = scratch_folder() / "session";
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit limit{rlim_t{24} << 20, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  const ProgramRun run = run_tankrig({"scan", "--rig", rig.string(), "--out", session.string()});
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_THAT(run.err, HasSubstr("File too large; laser off, arm at rest"));
  EXPECT_THAT(read_text(session / "events.csv"), HasSubstr(",laser,on"));
  EXPECT_EQ(run_tankrig({"session", "info", session.string()}).exit_code, 0);
}

}  // namespace
}  // namespace tankrig::test
