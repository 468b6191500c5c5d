// Files that are none, never end, or are far too large.
#include "core/regular_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/camera_file.hpp"
#include "core/config_node.hpp"
#include "core/input_error.hpp"
#include "core/mesh_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;
using testing::EndsWith;
using testing::HasSubstr;

std::string refusal(const fs::path& file, std::uint64_t most = 100) {
  return message_of<InputError>([&] { read_regular_file(file, most, "a text"); });
}

TEST(RegularFile, IsReadWholeUpToItsLimit) {
  const TemporaryFolder folder;
  const std::string text = std::string(100'000, 'x') + '\0' + "end";
  EXPECT_EQ(read_regular_file(folder.write("a", text), text.size(), "a text"), text);
  EXPECT_THAT(refusal(folder.path() / "a", text.size() - 1), HasSubstr("a: holds more than 0 MiB, expected a text"));
  EXPECT_EQ(read_regular_file(folder.write("empty", ""), 0, "a text"), "");
  EXPECT_FALSE(read_regular_file("/proc/self/status", 100'000, "a text").empty())
      << "whose size the system states as 0";
}

TEST(RegularFile, IsNoPipeNoDeviceAndNoFolder) {
  const TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder.path() / "pipe").c_str(), 0600), 0);
  EXPECT_THAT(refusal(folder.path() / "pipe"), EndsWith("pipe: is a pipe, a socket or a device, expected a text"));
  EXPECT_EQ(refusal("/dev/zero"), "/dev/zero: is a pipe, a socket or a device, expected a text");
  EXPECT_THAT(refusal(folder.path()), EndsWith(": is a folder, expected a text"));
  EXPECT_THAT(refusal(folder.path() / "none"), EndsWith("none: cannot be read, expected a text"));
}

TEST(RegularFile, OfATableMayBeWhatALongScanRecords) {
  const auto memory =
      static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(::getpagesize());
  EXPECT_GE(most_table_bytes(), memory / 2);
  EXPECT_GE(most_table_bytes(), std::uint64_t{2} << 30);
}

TEST(RegularFile, IsAskedForByEveryReaderOfOtherPeoplesText) {
  const TemporaryFolder folder;
  const fs::path pipe = folder.path() / "pipe", large = folder.write("large", "x");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  fs::resize_file(large, kMostMeshBytes + 1);  // without a block on the disk
  for (const fs::path& file : {pipe, large, fs::path("/dev/zero")}) {
    const auto refused = testing::AnyOf(HasSubstr("is a pipe, a socket or a device"), HasSubstr("holds more than"));
    EXPECT_THAT(message_of<InputError>([&] { ConfigNode::load(file); }), refused);
    EXPECT_THAT(message_of<InputError>([&] { read_camera_file(file); }), refused);
    EXPECT_THAT(message_of<InputError>([&] { check_mesh_file(file); }), refused);
  }
}

}  // namespace
}  // namespace tankrig
