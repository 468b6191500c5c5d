// Sessions as a browser downloads them: by plain names alone, and a bag only if the exporting program made one.
#include "console/server/session_downloads.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <optional>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

using ::testing::HasSubstr;

struct SessionDownloadsTest : ::testing::Test {
  SessionDownloadsTest() {
    folder.write("sessions/monday/session.yaml", "status: complete\n");
    exports("echo bag > $7/monday.bag");
  }
  /// The program that is asked for a bag: session export SESSION --format bag --out FOLDER.
  void exports(const std::string& script) const {
    const fs::path program = folder.write("program", "#!/bin/sh\n" + script + "\n");
    fs::permissions(program, fs::perms::owner_all);
  }
  WebReply ask(const std::string& path, bool moves = false) {
    WebReply reply;
    do reply = ask_once(path, moves);
    while (reply.body.find("has changed just now") != std::string::npos);  // the test is fast
    return reply;
  }
  WebReply ask_once(const std::string& path, bool moves) {
    std::optional<WebReply> got;
    downloads.get(path, moves, [&](WebReply reply) { got = std::move(reply); });
    io.restart();
    io.run();
    if (got && got->file >= 0) {
      char text[100];
      const ssize_t n = ::read(got->file, text, sizeof text);
      got->body.assign(text, static_cast<std::size_t>(std::max<ssize_t>(n, 0)));
      ::close(got->file);
    }
    return got.value_or(WebReply{.status = 0});
  }
  /// Beside sessions.
  std::size_t left() const {
    std::size_t count = 0;
    for (const auto& entry : fs::directory_iterator(sessions)) count += entry.path().filename() != "monday";
    return count;
  }

  TemporaryFolder folder;
  const fs::path sessions = folder.path() / "sessions";
  boost::asio::io_context io;
  SessionDownloads downloads{io, (folder.path() / "program").string(), sessions};
};

TEST_F(SessionDownloadsTest, AnArchiveComesPieceByPieceWithItsSizeSaidBefore) {
  const WebReply reply = ask("monday.zip");
  EXPECT_EQ(reply.status, 200U);
  EXPECT_EQ(reply.download_as, "monday.zip");
  std::string all;
  for (std::string piece; !(piece = reply.pieces()).empty();) all += piece;
  EXPECT_EQ(all.size(), reply.bytes);
  EXPECT_TRUE(all.starts_with("PK\3\4"));
}

TEST_F(SessionDownloadsTest, ArePlainNamesOfSessionsAlone) {
  folder.write("secret/session.yaml", "");
  folder.write("sessions/.hidden/session.yaml", "");
  folder.write("sessions/plain/file", "");
  fs::create_directory_symlink(folder.path() / "secret", sessions / "link");
  for (const char* path : {"", ".zip", "..zip", "../secret.zip", "/etc.zip", "monday", "monday.tar", ".hidden.zip",
                           "link.zip", "tuesday.zip", "monday/session.yaml.zip", "link.bag"})
    EXPECT_EQ(ask(path).status, 404U) << path;
  EXPECT_EQ(ask("plain.zip").status, 409U);
}

TEST_F(SessionDownloadsTest, ABagIsGoneFromTheDiskBeforeItIsSent) {
  const WebReply reply = ask("monday.bag");
  EXPECT_EQ(reply.status, 200U);
  EXPECT_EQ(reply.download_as, "monday.bag");
  EXPECT_EQ(reply.body, "bag\n");
  EXPECT_EQ(left(), 0U);
}

TEST_F(SessionDownloadsTest, ABagOfASessionWithLossesIsCalledSo) {
  exports("echo bag > $7/monday.bag; exit 3");
  EXPECT_EQ(ask("monday.bag").download_as, "monday-incomplete.bag");
}

TEST_F(SessionDownloadsTest, ABagThatCannotBeMadeIsSaidWhy) {
  exports("echo first >&2; echo 'built without librosbag-storage' >&2; exit 1");
  const WebReply reply = ask("monday.bag");
  EXPECT_EQ(reply.status, 409U);
  EXPECT_EQ(reply.body, "built without librosbag-storage\n");
  EXPECT_THAT(reply.policy, HasSubstr("frame-ancestors 'self'"));  // the page shows it
  exports("exit 0");
  EXPECT_EQ(ask("monday.bag").status, 500U);
  EXPECT_EQ(left(), 0U);
}

TEST_F(SessionDownloadsTest, ABagWaitsForTheRigAndForAnotherOne) {
  EXPECT_EQ(ask("monday.bag", true).status, 503U);
  std::vector<unsigned> got;
  for (int i = 0; i < 2; ++i)
    downloads.get("monday.bag", false, [&](const WebReply& reply) {
      got.push_back(reply.status);
      if (reply.file >= 0) ::close(reply.file);
    });
  io.restart();
  io.run();
  EXPECT_THAT(got, ::testing::ElementsAre(503U, 200U));
  EXPECT_EQ(ask("monday.bag").status, 200U);
}

TEST_F(SessionDownloadsTest, AFewArchivesAtATime) {
  std::vector<WebReply> held;
  for (int i = 0; i < 4; ++i) held.push_back(ask("monday.zip"));
  for (const WebReply& reply : held) EXPECT_EQ(reply.status, 200U);
  EXPECT_EQ(ask("monday.zip").status, 503U);
  held.pop_back();
  EXPECT_EQ(ask("monday.zip").status, 200U);
}

TEST_F(SessionDownloadsTest, WhatAKilledServerLeftIsRemovedWhenItIsOld) {
  for (const char* name : {".monday-bag.1.tmp", ".tuesday-bag.1.tmp"}) fs::create_directory(sessions / name);
  fs::last_write_time(sessions / ".monday-bag.1.tmp", fs::file_time_type::clock::now() - std::chrono::hours(1));
  const SessionDownloads fresh(io, "", sessions);
  EXPECT_EQ(left(), 1U);
}

}  // namespace
}  // namespace tankrig
