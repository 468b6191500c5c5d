// Files of sessions for a browser: what is below a session, and nothing else.
#include "console/server/session_files.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "tests/support/temporary_folder.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

struct SessionFiles : ::testing::Test {
  SessionFiles() {
    fs::create_directories(sessions / "one/frames");
    for (const char* file :
         {"sessions/one/report.html", "sessions/one/frames/0.png", "sessions/one/cloud.ply", "secret"})
      folder.write(file, file);
  }
  WebReply reply(const std::string& path) const {
    WebReply r = session_file(sessions, path);
    if (r.file >= 0) ::close(r.file);
    return r;
  }
  TemporaryFolder folder;
  const fs::path sessions = folder.path() / "sessions";
};

TEST_F(SessionFiles, AreServedByTheirKind) {
  EXPECT_EQ(reply("one/report.html").type, "text/html; charset=utf-8");
  EXPECT_EQ(reply("one/frames/0.png").type, "image/png");
  EXPECT_EQ(reply("one/cloud.ply").download_as, "cloud.ply");
  EXPECT_EQ(reply("one/report.html").download_as, "");
}

TEST_F(SessionFiles, OfAPageHaveNoneOfTheConsolesRights) {
  EXPECT_TRUE(reply("one/report.html").policy.starts_with("sandbox allow-scripts; default-src 'none'"));
}

TEST_F(SessionFiles, DoNotLeadElsewhere) {
  for (const char* path : {"", "one", "one/", "../secret", "one/../../secret", "/etc/passwd", "one/./report.html",
                           "two/report.html", "one/frames"})
    EXPECT_EQ(reply(path).status, 404U) << path;
}

TEST_F(SessionFiles, DoNotFollowLinks) {
  fs::create_symlink(folder.path() / "secret", sessions / "one/link.yaml");
  EXPECT_EQ(reply("one/link.yaml").status, 404U);
  fs::remove(sessions / "one/link.yaml");
  fs::create_directory_symlink(folder.path(), sessions / "out");
  EXPECT_EQ(reply("out/secret").status, 404U);
}

}  // namespace
}  // namespace tankrig
