// A session as a ZIP archive: what another program reads in it is what lies on the disk, or it breaks off.
#include "session/export/session_zip.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <cstdlib>

#include "core/input_error.hpp"
#include "session/recording/session_lock.hpp"
#include "tests/support/temporary_folder.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

using ::testing::HasSubstr;

constexpr std::uint64_t kLarge = (4ULL << 30) + 10;

/// Of as many zero bytes, by zlib.
unsigned long crc_of_zeros(std::uint64_t count) {
  unsigned long all = ::crc32(0, nullptr, 0), block = ::crc32(0, reinterpret_cast<const Bytef*>("\0"), 1);
  for (std::uint64_t size = 1; count > 0; count >>= 1, size <<= 1) {
    if (count & 1) all = ::crc32_combine(all, block, static_cast<z_off_t>(size));
    block = ::crc32_combine(block, block, static_cast<z_off_t>(size));
  }
  return all;
}

struct SessionZipTest : ::testing::Test {
  SessionZipTest() { folder.write("monday/session.yaml", "status: complete\n"); }

  /// Of the session once its times are old enough to tell of a change.
  SessionZip zipped() const {
    EXPECT_EQ(refusal(), "no error");
    return SessionZip(session);
  }
  /// All of it as a file; what is zero stays a hole. Its size is what was promised.
  fs::path archive() const {
    SessionZip zip = zipped();
    const fs::path file = folder.path() / "monday.zip";
    const int out = ::open(file.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0600);
    const std::string zeros(64 << 10, '\0');
    std::uint64_t size = 0;
    for (std::string piece; !(piece = zip.next()).empty(); size += piece.size()) {
      if (piece == zeros)
        ::lseek(out, static_cast<off_t>(piece.size()), SEEK_CUR);
      else
        EXPECT_EQ(::write(out, piece.data(), piece.size()), static_cast<ssize_t>(piece.size()));
    }
    ::close(out);
    EXPECT_EQ(size, zip.bytes());
    EXPECT_EQ(zip.next(), "");
    return file;
  }
  /// What Python says about it; `z` is the open archive.
  std::string python(const std::string& expression) const {
    const fs::path out = folder.path() / "said";
    const std::string script =
        "import sys, zipfile; z = zipfile.ZipFile(sys.argv[1]); print(" + expression + ", end='')";
    const std::string command = "python3 -c \"" + script + "\" " + archive().string() + " > " + out.string() + " 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << folder.read("said");
    return folder.read("said");
  }
  std::string refusal() const {
    std::string said;
    do said = message_of<InputError>([&] { const SessionZip zip(session); });
    while (said.find("just now") != std::string::npos);
    return said;
  }
  /// Of the rest, after `what` has happened behind the first piece's back.
  template <class What>
  std::string breaks_off(What what) const {
    SessionZip zip = zipped();
    EXPECT_FALSE(zip.next().empty());
    what();
    return message_of<InputError>([&] {
      while (!zip.next().empty()) {
      }
    });
  }

  TemporaryFolder folder;
  const fs::path session = folder.path() / "monday";
};

TEST_F(SessionZipTest, IsReadByAnotherProgramAsItWas) {
  std::string noise(200'000, '\0');
  unsigned state = 1;
  for (char& c : noise) c = static_cast<char>((state = state * 1664525 + 1013904223) >> 24);
  folder.write("monday/frames/mono/0.png", noise);
  folder.write("monday/frames/empty", "");
  folder.write("monday/Prüfung 1.txt", "ä");
  fs::create_directories(session / "clouds");  // empty: is left out
  EXPECT_EQ(python("z.testzip(), sorted(z.namelist())"),
            "None ['monday/Prüfung 1.txt', 'monday/frames/empty', 'monday/frames/mono/0.png', 'monday/session.yaml']");
  EXPECT_EQ(python("oct(z.getinfo('monday/session.yaml').external_attr >> 16)"), "0o100644");
  ASSERT_EQ(
      std::system(("cd " + folder.path().string() + " && mkdir out && python3 -m zipfile -e monday.zip out").c_str()),
      0);
  EXPECT_EQ(folder.read("out/monday/frames/mono/0.png"), noise);
  EXPECT_EQ(folder.read("out/monday/session.yaml"), "status: complete\n");
}

TEST_F(SessionZipTest, HoldsMoreThanThirtyTwoBitsCanSay) {
  folder.write("monday/a", "");
  fs::resize_file(session / "a", kLarge);
  folder.write("monday/b", "behind it");
  EXPECT_EQ(python("z.getinfo('monday/a').file_size, z.getinfo('monday/a').CRC, z.read('monday/b').decode()"),
            std::to_string(kLarge) + " " + std::to_string(crc_of_zeros(kLarge)) + " behind it");
}

TEST_F(SessionZipTest, HoldsMoreFilesThanSixteenBitsCanSay) {
  fs::create_directory(session / "frames");
  for (int i = 0; i < 65'600; ++i) ::close(::creat((session / "frames" / std::to_string(i)).c_str(), 0600));
  EXPECT_EQ(python("len(z.namelist()), z.testzip()"), "65601 None");
}

TEST_F(SessionZipTest, LeavesOutWhatIsUnfinished) {
  folder.write("monday/.clouds.1.tmp", "half");
  EXPECT_EQ(python("z.namelist()"), "['monday/session.yaml']");
}

TEST_F(SessionZipTest, BreaksOffWhereTheSessionChangesMeanwhile) {
  const std::string old(500'000, 'o');
  const fs::path file = session / "joints.csv";
  const auto fresh = [&] { folder.write("monday/joints.csv", old); };
  fresh();
  EXPECT_THAT(breaks_off([&] { fs::resize_file(file, old.size() + 1); }), HasSubstr("has changed while it was read"));
  fresh();
  EXPECT_THAT(breaks_off([&] { fs::resize_file(file, 1000); }), HasSubstr("is shorter than it was"));
  fresh();
  EXPECT_THAT(breaks_off([&] { fs::remove(session / "session.yaml"); }), HasSubstr("is not any more as it was"));
  folder.write("monday/session.yaml", "status: complete\n");
  EXPECT_THAT(breaks_off([&] { fs::rename(folder.write("other", "status: complete\n"), session / "session.yaml"); }),
              HasSubstr("is not any more as it was"));
  EXPECT_THAT(breaks_off([&] {
                fs::remove(session / "session.yaml");
                fs::create_symlink("/etc/passwd", session / "session.yaml");
              }),
              HasSubstr("is not any more as it was"));
  fs::remove(session / "session.yaml");
  folder.write("monday/session.yaml", "status: complete\n");
  folder.write("monday/a", "sent with the first piece");
  EXPECT_THAT(breaks_off([&] { fs::resize_file(session / "a", 3); }), HasSubstr("has changed meanwhile"));
  EXPECT_THAT(breaks_off([&] { folder.write("monday/report.html", "new"); }), HasSubstr("has changed meanwhile"));
}

TEST_F(SessionZipTest, IsRefusedForWhatIsNoFileOrHasANameThatLeadsElsewhere) {
  EXPECT_EQ(refusal(), "no error");
  fs::create_symlink("/etc/passwd", session / "link");
  EXPECT_THAT(refusal(), HasSubstr("link: is a link, a pipe or a device"));
  fs::remove(session / "link");
  ::mkfifo((session / "pipe").c_str(), 0600);
  EXPECT_THAT(refusal(), HasSubstr("pipe: is a link, a pipe or a device"));
  fs::remove(session / "pipe");
  for (const std::string name : {"..\\..\\up", "c:up", "line\nend", "\xff"}) {
    folder.write("monday/" + name, "");
    EXPECT_THAT(refusal(), HasSubstr("expected one that every system can read")) << name;
    fs::remove(session / name);
  }
  {
    const SessionLock recording(session);
    EXPECT_THAT(refusal(), HasSubstr("is being written"));
  }
  fs::remove(session / "session.yaml");
  EXPECT_THAT(refusal(), HasSubstr("has no session.yaml"));
}

}  // namespace
}  // namespace tankrig
