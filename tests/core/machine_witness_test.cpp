// Whether a test that needs a punctual machine is told of one that is not, and the end of a run counts it.
#include "tests/support/machine_witness.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using testing_support::MachineWitness;

/// Holds this thread's processor against everybody. The longest that it had it in one piece, which is less than `time`
/// where the kernel's limit on real-time threads took it back in between; 0 if it may not.
Duration hold(Duration time) {
  cpu_set_t only;
  CPU_ZERO(&only);
  CPU_SET(::sched_getcpu(), &only);
  sched_param highest{};
  highest.sched_priority = ::sched_get_priority_max(SCHED_FIFO);
  if (::pthread_setaffinity_np(::pthread_self(), sizeof only, &only) != 0 ||
      ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &highest) != 0)
    return {};
  const MonotonicClock clock;
  Duration longest{};
  Stamp begin = clock.now();
  for (Stamp last = begin, now = begin, end = begin + time; now < end; last = now) {
    now = clock.now();
    if (now - last > 1ms) begin = now;
    longest = std::max(longest, now - begin);
  }
  return longest;
}

TEST(MachineWitness, TellsAProcessorThatIsTakenAwayBeforeItIsBack) {
  MachineWitness sut;
  Duration held{}, while_held{};
  std::thread([&] {
    held = hold(80ms);
    while_held = sut.latest();
  }).join();
  if (held == Duration{}) GTEST_SKIP() << "no right to SCHED_FIFO";
  const Duration told = held - 5ms;
  EXPECT_GE(while_held, told);
  EXPECT_GE(sut.latest(), told);
  const auto late = sut.lateness();
  EXPECT_TRUE(std::any_of(late.begin(), late.end(), [&](const auto& one) { return one.came - one.due >= told; }));
}

/// Of a log with these lines.
std::string end_of_run(const std::string& log) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "LastTest.log") << log;
  const std::string command = "awk -f '" TANKRIG_SOURCE_DIR "/tests/support/late_tests.awk' '" +
                              (folder.path() / "LastTest.log").string() + "'";
  FILE* const out = ::popen(command.c_str(), "r");
  std::string text;
  for (int c = 0; (c = std::fgetc(out)) != EOF;) text.push_back(static_cast<char>(c));
  return ::pclose(out) == 0 ? text : "awk failed";
}

TEST(EndOfRun, NamesWhatWasSkippedForLatenessAndNothingElse) {
  const std::string late = testing_support::machine_was_late(37200us, 25ms) + "\n";
  EXPECT_EQ(end_of_run("1/3 Testing: core.A\n[ RUN      ] A.B\nfile.cpp:1: Skipped\nno right\n[  SKIPPED ] A.B\n"),
            "skipped because the machine was late: 0 tests\n");
  EXPECT_EQ(
      end_of_run("1/2 Testing: arm.A.B\n[ RUN      ] A.B\n" + late +
                 "2/3 Testing: scenarios.wires\n[1/2] laser off\nlaser off, on can: " + late +
                 "3/3 Testing: program.wire\n[ RUN      ] C.D/can\nok\n[ RUN      ] C.E/can\n" + late),
      "skipped because the machine was late: 3 tests\n"
      "  arm.A.B: by 37.2 ms\n  scenarios.wires: laser off, on can: by 37.2 ms\n  program.wire, C.E/can: by 37.2 ms\n");
}

}  // namespace
}  // namespace tankrig
