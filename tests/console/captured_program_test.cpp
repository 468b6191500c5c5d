// A command that is run for its output: what it prints, how it ends, and that it must end in time.
#include "console/server/captured_program.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <optional>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

Captured captured(const std::string& commands, std::chrono::seconds longest = 60s) {
  boost::asio::io_context io;
  std::optional<Captured> end;
  capture(
      io, {"/bin/sh", "-c", commands}, [&](const Captured& found) { end = found; }, longest);
  io.run();
  EXPECT_TRUE(end);
  return end.value_or(Captured{-1, "", ""});
}

TEST(CapturedProgram, IsToldWithWhatItPrintedAndItsExitCode) {
  const Captured end = captured("cat; echo out; echo err >&2; exit 3");
  EXPECT_EQ(end.out, "out\n");
  EXPECT_EQ(end.err, "err\n");
  EXPECT_EQ(end.exit_code, 3);
}

TEST(CapturedProgram, IsEndedIfItTakesTooLong) {
  const auto begin = std::chrono::steady_clock::now();
  const Captured end = captured("echo begun; exec sleep 600", 1s);
  const auto took = std::chrono::steady_clock::now() - begin;
  EXPECT_EQ(end.out, "begun\n");
  EXPECT_EQ(end.exit_code, 128 + 15) << "SIGTERM";
  EXPECT_GE(took, 1s);
  EXPECT_LT(took, 30s);
}

TEST(CapturedProgram, IsEndedIfItPrintsWithoutEnd) { EXPECT_EQ(captured("exec yes").exit_code, 128 + 15); }

TEST(CapturedProgram, IsNamedIfThereIsNone) {
  boost::asio::io_context io;
  EXPECT_THROW(capture(io, {"/nowhere/program"}, [](const Captured&) { ADD_FAILURE(); }), InputError);
  io.run();
}

}  // namespace
}  // namespace tankrig
