// `tankrig arm` and `tankrig camera preview` in real time, over the wires of emulated devices.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <csignal>
#include <cstdlib>
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <thread>

#include "tests/program/benchmark_text.hpp"
#include "tests/program/program.hpp"
#include "tests/support/fake_logind.hpp"
#include "tests/support/machine_witness.hpp"
#include "tests/support/named_thread.hpp"
#include "tests/support/sanitizers.hpp"

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

namespace tankrig::test {
namespace {

fs::path wire_rig(const Edits& edits = {}) { return patient_wire_rig(scratch_folder() / "rig", edits); }

/// Its arm has just been switched on, and homes without long pauses.
fs::path rig_not_homed() {
  return wire_rig({{"    homed: true", "    homed: false"},
                   {"    driver: arm5e\n", "    driver: arm5e\n    homing: {pause_s: 0.1}\n"}});
}

double reached(const nlohmann::json& report, const std::string& name) {
  for (const auto& joint : report.at("joints"))
    if (joint.at("name") == name) return joint.at("reached_deg").get<double>();
  throw std::runtime_error("no joint " + name);
}

TEST(OnTheWire, StatusTellsWhatTheCarrierDoes) {
  const ProgramRun run = run_tankrig({"arm", "status", "--rig", wire_rig().string(), "--json"});
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto status = run.json();
  EXPECT_EQ(status.at("homed"), true);
  EXPECT_GT(status.at("states").get<int>(), 20);
  EXPECT_GT(status.at("current_a").get<double>(), 0);
  const double load = status.at("statistics").at("bus_load_percent").get<double>();
  EXPECT_GT(load, 5);
  EXPECT_LE(load, 70);
  EXPECT_EQ(status.at("statistics").at("checksum_errors").get<double>(), 0);
}

TEST(OnTheWire, StatusLeavesAnArmAloneThatAnotherProgramMovesAndReportsWhereItCannotWrite) {
  const std::string rig = wire_rig().string();
  const ProgramRun run = run_tankrig({"emulate", "--rig", rig, "--", "bash", "-c", R"(
      zero=$TANKRIG_RUNTIME/arm-zero.yaml status="tankrig arm status --rig $0"
      flock $zero.lock $status && exit 99
      rm $zero.lock
      mkdir $zero.lock
      sed -i '/orderly_exit/,$ s/elbow: .*/elbow: 20000/' $zero
      exec $status)",
                                      rig});
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.err, HasSubstr("another program is moving the arm; wait for it to end"));
  EXPECT_THAT(run.err, HasSubstr("the loss of the arm's zero is not kept: "));
  EXPECT_THAT(run.out, HasSubstr("but 20000 where it was left"));
}

/// Neither relay nor arm has a watchdog here.
TEST(OnTheWire, TheGuardianOfAKilledCommandMakesSafeAndTheNextCommandSaysSo) {
  const std::string rig =
      wire_rig({{"\nemulation:\n  arm:\n", "\nemulation:\n  laser: {watchdog_ms: 0}\n  arm:\n    watchdog_ms: 0\n"}})
          .string();
  const ProgramRun run =
      run_tankrig({"emulate", "--rig", rig, "--device", "arm", "--device", "laser", "--", "bash", "-c", R"(
      tankrig arm jog --rig $0 elbow 30 --relative 2> $TANKRIG_RUNTIME/said &
      until grep -q 'arm: move' $TANKRIG_RUNTIME/said; do kill -0 $! || exit 98; done
      kill -KILL $!
      wait $!
      until [ -e $TANKRIG_RUNTIME/arm-zero.yaml.guardian ]; do :; done
      tankrig arm stop --rig $0 || exit 97
      cat $TANKRIG_RUNTIME/said >&2
      tankrig guardian --rig $0 --acknowledge 'the power is cut' 2> $TANKRIG_RUNTIME/nobody && exit 96
      tankrig arm status --rig $0 --json)",
                   rig});
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("laser off, arm at rest"));
  EXPECT_THAT(run.err, HasSubstr("guardian: takes over: process"));
  EXPECT_THAT(run.err, HasSubstr("an earlier command's guardian: "));
  EXPECT_THAT(run.err, HasSubstr("laser off, arm at rest; laser off confirmed after"));
}

TEST(OnTheWire, HalfARigIsEnoughForWhatUsesOnlyThatHalf) {
  const fs::path served = patient_wire_rig(scratch_folder() / "served");
  const fs::path half = wire_rig({{"device: runtime/laser", "device: runtime/unplugged"},
                                  {"opening_timeout_s: 20", "opening_timeout_s: 0.2"},
                                  {"127.0.0.2", "127.0.0.99"}});
  const std::string preview = (scratch_folder() / "see.png").string();
  const std::vector<std::vector<std::string>> commands{
      {"arm", "status", "--rig", half.string(), "--json"},
      {"camera", "preview", "--rig", half.string(), "--camera", "mono", "--seconds", "3", "--out", preview, "--json"}};
  for (const std::vector<std::string>& command : commands) {
    std::vector<std::string> words{"emulate", "--rig", served.string(), "--", "tankrig"};
    words.insert(words.end(), command.begin(), command.end());
    const ProgramRun run = run_tankrig(words);
    if (forbids_private_network(run)) GTEST_SKIP() << run.err;
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(run.err, HasSubstr("the laser's state is not known, it may be on"));
  }
  EXPECT_TRUE(fs::exists(preview));
  const ProgramRun jog = run_tankrig(
      {"emulate", "--rig", served.string(), "--", "tankrig", "arm", "jog", "--rig", half.string(), "elbow", "47"});
  EXPECT_EQ(jog.exit_code, 1) << "an arm moves only beside a laser that is off";
  EXPECT_THAT(jog.err, HasSubstr("devices.laser"));
}

/// Neither scene nor emulation: a person sets the light.
TEST(OnTheWire, AnExperimentTellsOfALaserItCannotReachAndIsStoppedWhileItWaitsForTheLight) {
  const fs::path served = patient_wire_rig(scratch_folder() / "served");
  const fs::path rig = wire_rig(
      {{"device: runtime/laser", "device: runtime/unplugged"}, {"opening_timeout_s: 20", "opening_timeout_s: 0.2"}});
  edit(rig.parent_path() / "base.yaml", {{"\nscene: tank.xml", ""}});
  const std::string text = read_text(rig);
  write_text(rig, text.substr(0, text.find("\nemulation:")));
  const fs::path file = scratch_folder() / "level.xml";
  write_text(file, "<benchmark><measures>" + cloud("laser") + "</measures>" + kAlways +
                       "<function>laser.coverage</function><sceneUpdater><luxUpdater><level>90000</level>"
                       "<interval>0</interval></luxUpdater></sceneUpdater></benchmark>\n");
  const ProgramRun run =
      run_tankrig({"emulate", "--rig", served.string(), "--device", "lux", "--", "tankrig", "experiment", file.string(),
                   "--rig", rig.string(), "--out", (scratch_folder() / "out").string()},
                  [](const std::string& line, int pid) {
                    if (line.find("set the light to 90000 lx") != std::string::npos) ::kill(pid, SIGINT);
                  });
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_THAT(run.err, HasSubstr("the laser's state is not known, it may be on"));
  EXPECT_THAT(run.err, HasSubstr("stopped before the light was set: nothing moved"));
}

/// Stops the emulator of the program that this process runs, as soon as there is one. It goes on when it is told to, or
/// after kLongest, however its test ends.
/// Threads: owns one.
class StoppedEmulator {
 public:
  StoppedEmulator() : thread_([this, parent = getpid()] { run(parent); }) {}
  ~StoppedEmulator() {
    go_on();
    thread_.join();
  }
  StoppedEmulator(const StoppedEmulator&) = delete;
  StoppedEmulator& operator=(const StoppedEmulator&) = delete;

  void go_on() {
    const std::lock_guard lock(mutex_);
    ends_ = true;
    wake_.notify_all();
  }
  /// Nothing: it was not.
  std::optional<Stamp> stopped() {
    const std::lock_guard lock(mutex_);
    return stopped_;
  }

 private:
  static constexpr std::chrono::seconds kLongest{20};
  static constexpr std::chrono::milliseconds kLook{1};

  void run(pid_t parent) {
    const auto deadline = std::chrono::steady_clock::now() + kLongest;
    const auto over = [this] { return ends_; };
    std::unique_lock lock(mutex_);
    pid_t emulator = 0;
    for (; emulator <= 0; wake_.wait_for(lock, kLook, over)) {
      if (ends_ || std::chrono::steady_clock::now() > deadline) return;
      const pid_t program = testing_support::child_of(parent);
      if (program > 0) emulator = testing_support::child_of(program);
    }
    if (kill(emulator, SIGSTOP) != 0) return;
    stopped_ = MonotonicClock{}.now();
    wake_.wait_until(lock, deadline, over);
    kill(emulator, SIGCONT);
  }

  std::mutex mutex_;  // guards what follows
  std::condition_variable wake_;
  bool ends_ = false;
  std::optional<Stamp> stopped_;
  std::thread thread_;
};

TEST(OnTheWire, SaysWhatItWaitsForWhereTheEmulatorIsStoppedAtItsStart) {
  constexpr Duration kSaidAfter = std::chrono::seconds{2}, kBearable = std::chrono::milliseconds{100};
  const fs::path rig = wire_rig();
  const testing_support::MachineWitness witness;
  StoppedEmulator emulator;
  std::optional<Stamp> told;
  const ProgramRun run =
      run_tankrig({"arm", "status", "--rig", rig.string(), "--json"}, [&](const std::string& line, int) {
        if (told || line.find("waiting for the emulated devices to be ready: process ") == std::string::npos) return;
        told = MonotonicClock{}.now();
        emulator.go_on();
      });
  emulator.go_on();
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  if (!told) {  // an emulator that is ready before it is stopped
    TANKRIG_SKIP_IF_LATE(witness, testing_support::kStarved);
  }
  ASSERT_TRUE(told && emulator.stopped()) << run.err;
  EXPECT_EQ(run.exit_code, 0) << run.err;
  TANKRIG_SKIP_IF_LATE(witness, kBearable);
  EXPECT_NEAR(seconds(*told - *emulator.stopped()), seconds(kSaidAfter), 3 * seconds(kBearable));
}

/// What programs that are run while it lives take for the system's message bus.
class SystemBus {
 public:
  explicit SystemBus(const std::string& address) { ::setenv(kName, address.c_str(), 1); }
  ~SystemBus() { ::unsetenv(kName); }
  SystemBus(const SystemBus&) = delete;
  SystemBus& operator=(const SystemBus&) = delete;

 private:
  static constexpr const char* kName = "DBUS_SYSTEM_BUS_ADDRESS";
};

constexpr char kMayBeSuspended[] = "this machine is not kept from being suspended";

TEST(OnTheWire, TheMachineIsKeptFromSleepingForAsLongAsAnArmMayMove) {
  testing_support::FakeLogind logind;
  const SystemBus bus(logind.address());
  int held = 0;
  const ProgramRun run =
      run_tankrig({"arm", "jog", "--rig", wire_rig().string(), "elbow", "50"}, [&](const std::string& line, int) {
        if (line.find("arm: move elbow") != std::string::npos) held = logind.held();
      });
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(held, std::ssize(testing_support::kAllInhibitors));
  EXPECT_EQ(logind.asked(), testing_support::kAllInhibitors);
  EXPECT_THAT(run.err, Not(HasSubstr(kMayBeSuspended)));
  logind.wait_until_given_back();
}

TEST(OnTheWire, AnArmMovesWhereNothingKeepsTheMachineFromSleepingAndThatIsTold) {
  const SystemBus nowhere("unix:path=" + (scratch_folder() / "no-bus").string());
  const ProgramRun run = run_tankrig({"arm", "jog", "--rig", wire_rig().string(), "elbow", "47"});
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr(kMayBeSuspended));
  EXPECT_THAT(run.err, HasSubstr("No such file or directory"));
}

TEST(OnTheWire, AJogArrivesOverEitherCarrier) {
  const fs::path rig = wire_rig();
  for (const std::string carrier : {"can", "serial"}) {
    const ProgramRun run =
        run_tankrig({"arm", "jog", "--rig", rig.string(), "--carrier", carrier, "elbow", "47", "--json"});
    if (forbids_private_network(run)) GTEST_SKIP() << run.err;
    ASSERT_EQ(run.exit_code, 0) << carrier << ": " << run.err;
    EXPECT_NEAR(reached(run.json(), "elbow"), 47, 0.6) << carrier;
    EXPECT_EQ(run.json().at("arm_at_rest"), true) << carrier;
  }
}

TEST(OnTheWire, CtrlCStopsAJogOnItsWay) {
  const fs::path rig = wire_rig();
  bool sent = false;
  const ProgramRun run = run_tankrig({"arm", "jog", "--rig", rig.string(), "shoulder", "60", "--json"},
                                     [&](const std::string& line, int pid) {
                                       if (!sent && line.find("arm: move shoulder") != std::string::npos)
                                         sent = kill(pid, SIGINT) == 0;
                                     });
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  ASSERT_TRUE(sent) << run.err;
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_THAT(run.err, HasSubstr("arm stopped: asked for; laser off, arm at rest"));
  EXPECT_LT(reached(run.json(), "shoulder"), 55);
}

TEST(OnTheWire, CtrlCTwiceInASweepStillEndsWithLaserAndArmConfirmed) {
  testing_support::FakeLogind logind;
  const SystemBus bus(logind.address());
  int sent = 0, held = 0;
  const fs::path session = scratch_folder() / "session";
  const ProgramRun run = run_tankrig({"scan", "--rig", wire_rig().string(), "--out", session.string()},
                                     [&](const std::string& line, int pid) {
                                       if (sent > 0 || line.find("scan: sweep") == std::string::npos) return;
                                       held = logind.held();
                                       for (int i = 0; i < 2; ++i) sent += kill(pid, SIGINT) == 0;
                                     });
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  ASSERT_EQ(sent, 2) << run.err;
  EXPECT_EQ(held, std::ssize(testing_support::kAllInhibitors)) << "no sleep while it shines";
  logind.wait_until_given_back();
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_THAT(run.err, HasSubstr("laser off, arm at rest"));
  EXPECT_EQ(run_tankrig({"session", "info", session.string()}).exit_code, 0);
}

TEST(OnTheWire, AnArmThatIsNotHomedIsSentHomeBeforeItMoves) {
  const fs::path rig = rig_not_homed();
  const ProgramRun status = run_tankrig({"arm", "status", "--rig", rig.string(), "--json"});
  if (forbids_private_network(status)) GTEST_SKIP() << status.err;
  ASSERT_EQ(status.exit_code, 0) << status.err;
  EXPECT_EQ(status.json().at("homed"), false);
  EXPECT_TRUE(status.json().at("at_rest").is_null());
  EXPECT_TRUE(status.json().at("joints")[0].at("angle_deg").is_null());
  const ProgramRun jog = run_tankrig({"arm", "jog", "--rig", rig.string(), "elbow", "1", "--relative"});
  EXPECT_EQ(jog.exit_code, 1);
  EXPECT_THAT(jog.err, HasSubstr("not homed"));
  EXPECT_THAT(jog.err, HasSubstr("tankrig arm home --rig"));
}

TEST(OnTheWire, CtrlCEndsHomingWithTheArmAtRestAndNotHomed) {
  const fs::path rig = rig_not_homed();
  bool sent = false;
  const ProgramRun run =
      run_tankrig({"arm", "home", "--rig", rig.string(), "--yes"}, [&](const std::string& line, int pid) {
        if (!sent && line.find("arm: home slew") != std::string::npos) sent = kill(pid, SIGINT) == 0;
      });
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  ASSERT_TRUE(sent) << run.err;
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_THAT(run.err, HasSubstr("not homed"));
  EXPECT_THAT(run.err, HasSubstr("laser off, arm at rest"));
}

TEST(OnTheWire, HomesThenKnowsItsJointsAndLeavesItsStops) {
  const fs::path rig = rig_not_homed();
  const fs::path script = scratch_folder() / "home.sh";
  const std::string arm = std::string(TANKRIG_PROGRAM) + " arm ";
  const std::string at_rig = " --rig " + rig.string() + " --json";
  const auto file = [](const char* name) { return (scratch_folder() / name).string(); };
  write_text(script, "set -e\n" + arm + "home --yes" + at_rig + " > " + file("home.json") + "\n" + arm +
                         "jog slew -80" + at_rig + " > " + file("jog.json") + "\n" + arm + "status" + at_rig + " > " +
                         file("status.json") + "\n");
  const ProgramRun run = run_tankrig({"emulate", "--rig", rig.string(), "--", "sh", script.string()});
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  ASSERT_EQ(run.exit_code, 0) << run.err;

  const auto home = nlohmann::json::parse(read_text(file("home.json")));
  EXPECT_EQ(home.at("status"), "homed");
  EXPECT_EQ(home.at("joints").size(), 5u);
  EXPECT_EQ(home.at("arm_at_rest"), true);
  EXPECT_NEAR(reached(nlohmann::json::parse(read_text(file("jog.json"))), "slew"), -80, 0.6);
  const auto status = nlohmann::json::parse(read_text(file("status.json")));
  EXPECT_EQ(status.at("homed"), true);
  EXPECT_NEAR(status.at("joints")[0].at("angle_deg").get<double>(), -80, 0.6);
}

/// Near its stops, not homed.
Edits beside_its_stops() {
  return {{"    homed: true", "    homed: false"},
          {"[0, 0.13, 0.9, 0, 0.1]", "[-1.45, 0.05, 2.05, 0, 0.1]"},
          {"    driver: arm5e\n", "    driver: arm5e\n    homing: {pause_s: 0.1}\n"}};
}

TEST(OnTheWire, AnArmThatIsHomedButNotSeenAtRestIsNotCalledNotHomed) {
  Edits edits = beside_its_stops();
  edits.push_back({"      exchange_rate_hz: 350", "      exchange_rate_hz: 5"});
  edits.push_back({"silence_timeout_ms: 1000", "silence_timeout_ms: 5000"});
  edits.push_back({"  safety:\n", "  safety:\n    rest_timeout_s: 0.2\n"});  // two readings in it: no run of them
  const fs::path rig = wire_rig(edits);
  const ProgramRun run = run_tankrig({"arm", "home", "--rig", rig.string(), "--yes", "--json"});
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_EQ(run.json().at("status"), "homed") << run.err;
  EXPECT_EQ(run.json().at("arm_at_rest"), false);
  EXPECT_THAT(run.err, HasSubstr("zero kept in "));
  EXPECT_THAT(run.err, HasSubstr("arm homed, but not confirmed safe afterwards: "
                                 "laser off; ARM MAY BE MOVING: cut its power, then home again"));
  EXPECT_THAT(run.err, Not(HasSubstr("not homed")));
}

TEST(OnTheWire, AZeroThatCannotBeWrittenStillTellsWhatWasLeft) {
  Edits edits = beside_its_stops();
  edits.push_back({"zero_file: runtime/arm-zero.yaml", "zero_file: zeros/arm-zero.yaml"});
  const fs::path rig = wire_rig(edits), zeros = rig.parent_path() / "zeros";
  fs::create_directories(zeros);
  const ProgramRun run =
      run_tankrig({"arm", "home", "--rig", rig.string(), "--yes", "--json"}, [&](const std::string& line, int) {
        if (line.find("arm: home slew") != std::string::npos) fs::remove_all(zeros);
      });
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_EQ(run.json().at("status"), "homed") << run.err;
  EXPECT_THAT(run.err, HasSubstr("arm homed, but its zero is not kept: "));
  EXPECT_THAT(run.err,
              HasSubstr("arm-zero.yaml: cannot be written: No such file or directory; laser off, arm at rest"));
}

TEST(OnTheWire, APreviewRunsUntilCtrlCAndThatIsNoFailure) {
  const fs::path out = scratch_folder() / "see.png";
  int refreshes = 0;
  const ProgramRun run = run_tankrig(
      {"camera", "preview", "--rig", wire_rig().string(), "--camera", "left", "--out", out.string(), "--json"},
      [&](const std::string& line, int pid) {
        if (line.find("focus") != std::string::npos && ++refreshes == 3) kill(pid, SIGINT);
      });
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_GE(run.json().at("refreshes").get<int>(), 3);
  EXPECT_EQ(cv::imread(out.string()).cols, 640);
}

TEST(OnTheWire, ALitPreviewLeavesTheLaserOffAndTheArmWhereItWas) {
  TANKRIG_SKIP_SANITIZED("no emulated camera has a picture in time for a preview's heartbeat");
  const fs::path rig = wire_rig();
  const ProgramRun run = run_tankrig({"camera", "preview", "--rig", rig.string(), "--laser", "--yes", "--seconds", "2",
                                      "--out", (scratch_folder() / "lit.png").string(), "--json"});
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("stripe"));
  EXPECT_THAT(run.err, HasSubstr("laser off, arm at rest"));
  EXPECT_GT(run.json().at("frames").get<int>(), 20);
}

}  // namespace
}  // namespace tankrig::test
