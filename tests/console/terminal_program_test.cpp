// A command on a terminal of its own: what it prints and feeds, Ctrl-C, and the end of either side.
#include "console/server/terminal_program.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <csignal>

#include "console/feed/feed_format.hpp"

namespace tankrig {
namespace {

using ::testing::HasSubstr;

constexpr int kPatience_ms = 10'000;

bool readable(int descriptor) {
  pollfd wanted{descriptor, POLLIN, 0};
  return ::poll(&wanted, 1, kPatience_ms) == 1;
}

/// Until it holds `wanted`, the program has ended, or patience has.
std::string printed(const TerminalProgram& program, const std::string& wanted) {
  std::string out;
  std::array<char, 1024> buffer{};
  while (out.find(wanted) == std::string::npos && readable(program.terminal())) {
    const ssize_t n = ::read(program.terminal(), buffer.data(), buffer.size());
    if (n <= 0) break;
    out.append(buffer.data(), static_cast<std::size_t>(n));
  }
  return out;
}

std::vector<std::string> shell(const std::string& script) { return {"/bin/sh", "-c", script}; }

TEST(TerminalProgram, PrintsOnATerminalAndReadsFromIt) {
  TerminalProgram program(shell("test -t 0 && test -t 2 && read line && echo got $line"));
  program.type("hello\r");
  EXPECT_THAT(printed(program, "got hello"), HasSubstr("got hello"));
  ASSERT_TRUE(readable(program.end()));
  EXPECT_EQ(program.exit_code(), 0);
}

TEST(TerminalProgram, IsInterruptedAsByCtrlCAlsoWhereItsStarterIgnoresThat) {
  const auto before = std::signal(SIGINT, SIG_IGN);
  TerminalProgram program(shell("trap 'echo stopped; exit 3' INT; echo ready; while :; do sleep 0.05; done"));
  ASSERT_THAT(printed(program, "ready"), HasSubstr("ready"));
  std::signal(SIGINT, before);
  program.interrupt();
  EXPECT_THAT(printed(program, "stopped"), HasSubstr("stopped"));
  ASSERT_TRUE(readable(program.end()));
  EXPECT_EQ(program.exit_code(), 3);
}

TEST(TerminalProgram, LosesItsTerminalWithWhoeverStartedIt) {
  std::string file = ::testing::TempDir() + "hangup_XXXXXX";
  ::close(::mkstemp(file.data()));
  {
    TerminalProgram program(
        shell("trap 'echo hung up > " + file + "; exit' HUP; echo ready; while :; do sleep 0.05; done"));
    ASSERT_THAT(printed(program, "ready"), HasSubstr("ready"));
  }
  std::string said;
  for (int i = 0; i < kPatience_ms / 10 && said.empty(); ++i) {
    ::poll(nullptr, 0, 10);
    if (FILE* f = std::fopen(file.c_str(), "r")) {
      std::array<char, 64> line{};
      if (std::fgets(line.data(), line.size(), f)) said = line.data();
      std::fclose(f);
    }
  }
  ::unlink(file.c_str());
  EXPECT_EQ(said, "hung up\n");
}

TEST(TerminalProgram, FeedsWholeMessages) {
  TerminalProgram program({"/usr/bin/python3", "-c",
                           "import os, socket\n"
                           "s = socket.socket(fileno=int(os.environ['TANKRIG_FEED']))\n"
                           "s.send(b'T{}')\n"
                           "s.send(b'P\\x04monoJPEG')\n"});
  std::array<char, 100> buffer{};
  ASSERT_TRUE(readable(program.feed()));
  EXPECT_EQ(::recv(program.feed(), buffer.data(), buffer.size(), 0), 3);
  ASSERT_TRUE(readable(program.feed()));
  const ssize_t n = ::recv(program.feed(), buffer.data(), buffer.size(), 0);
  ASSERT_EQ(n, 10);
  EXPECT_EQ(pictured_camera({buffer.data(), static_cast<std::size_t>(n)}), "mono");
}

TEST(TerminalProgram, TellsASignalThatEndedIt) {
  TerminalProgram program(shell("kill -KILL $$"));
  ASSERT_TRUE(readable(program.end()));
  EXPECT_EQ(program.exit_code(), 137);
}

TEST(FeedFormat, IsNoPictureWhereItsNameIsCutOff) {
  EXPECT_EQ(pictured_camera("P\x09mono"), std::nullopt);
  EXPECT_EQ(pictured_camera("T{}"), std::nullopt);
  EXPECT_EQ(pictured_camera(""), std::nullopt);
}

}  // namespace
}  // namespace tankrig
