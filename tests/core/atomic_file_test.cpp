// Files that are whole or not there: tests/session/failing_disk_test.cpp lets every step of them fail.
#include "core/atomic_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>

#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

TEST(DurableFile, ReplacesWhatWasThere) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "a.txt";
  write_file_durably(file, "first");
  write_file_durably(file, std::string_view("second\0", 7));
  EXPECT_EQ(folder.read("a.txt"), std::string("second\0", 7));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator{}), 1);
}

TEST(DurableFile, ThatFindsNoRoomLeavesTheOldOneAndNothingElse) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "a.txt";
  write_file_durably(file, "old");
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{100, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const std::string said = message_of<CannotWrite>([&] { write_file_durably(file, std::string(1000, 'x')); });
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_THAT(said, HasSubstr("a.txt: cannot be written: File too large"));
  EXPECT_EQ(folder.read("a.txt"), "old");
  EXPECT_FALSE(fs::exists(file.string() + kUnfinished));
}

TEST(DurableFile, NamesTheFileThatHasNoFolder) {
  const TemporaryFolder folder;
  EXPECT_THAT(message_of<CannotWrite>([&] { write_file_durably(folder.path() / "no/a.txt", "x"); }),
              HasSubstr("no/a.txt: cannot be written: No such file or directory"));
}

TEST(DurableFile, FollowsNoLinkThatLiesInItsWay) {
  const TemporaryFolder folder;
  const fs::path elsewhere = folder.write("elsewhere.txt", "precious"), file = folder.path() / "a.txt";
  fs::create_symlink(elsewhere, file.string() + kUnfinished);
  write_file_durably(file, "new");
  EXPECT_EQ(folder.read("elsewhere.txt"), "precious");
  EXPECT_EQ(folder.read("a.txt"), "new");
}

TEST(DurableFile, TakesNoFileThatLiesInItsWay) {
  const TemporaryFolder folder;
  for (const char* mine : {"a.txt.tmp", "a.txt.1.tmp"}) folder.write(mine, "mine");
  write_file_durably(folder.path() / "a.txt", "new");
  EXPECT_EQ(folder.read("a.txt"), "new");
  for (const char* mine : {"a.txt.tmp", "a.txt.1.tmp"}) EXPECT_EQ(folder.read(mine), "mine");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator{}), 3);
}

TEST(UnfinishedFolder, IsPutInPlaceOrGoneAndTakesNothingInItsWay) {
  const TemporaryFolder folder;
  folder.write("deep/.a.1.tmp/diary", "mine");
  {
    const UnfinishedFolder left(folder.path() / "deep/a");
    write_whole_file(left.path() / "b.txt", "half");
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path() / "deep"), fs::directory_iterator{}), 1);
  UnfinishedFolder made(folder.path() / "deep/x/../a/");
  EXPECT_EQ(made.target(), folder.path() / "deep/a");
  write_whole_file(made.path() / "b.txt", "whole");
  EXPECT_FALSE(fs::exists(folder.path() / "deep/a"));
  made.put_in_place();
  EXPECT_EQ(folder.read("deep/a/b.txt"), "whole");
  EXPECT_EQ(folder.read("deep/.a.1.tmp/diary"), "mine");
}

}  // namespace
}  // namespace tankrig
