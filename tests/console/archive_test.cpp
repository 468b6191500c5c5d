// Archives of strangers: plain files and folders come out, everything else is refused by name.
#include "console/platform/archive.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <zlib.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "core/input_error.hpp"
#include "tests/support/temporary_folder.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

using ::testing::HasSubstr;

std::string octal(std::size_t value, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "%0*zo", digits, value);
  return text;
}

/// Its sum made right.
std::string summed(std::string block) {
  block.replace(148, 8, 8, ' ');
  unsigned sum = 0;
  for (const unsigned char c : block) sum += c;
  block.replace(148, 7, octal(sum, 6) + std::string(1, '\0'));
  return block;
}

/// A header as POSIX.1-1988 has it.
std::string header(const std::string& name, std::size_t size, char type = '0', std::size_t mode = 0644) {
  std::string block(512, '\0');
  block.replace(0, name.size(), name);
  block.replace(100, 7, octal(mode, 7));
  block.replace(124, 11, octal(size, 11));
  block[156] = type;
  block.replace(257, 8, std::string("ustar\00000", 8));
  return summed(block);
}

std::string entry(const std::string& name, const std::string& bytes, char type = '0') {
  return header(name, bytes.size(), type) + bytes + std::string((512 - bytes.size() % 512) % 512, '\0');
}

std::string pax(const std::string& key, const std::string& value) {
  const std::string rest = " " + key + "=" + value + "\n";
  std::size_t length = rest.size() + 2;
  if (std::to_string(length).size() > 2) ++length;
  return std::to_string(length) + rest;
}

const std::string kEnd(1024, '\0');

struct ArchiveTest : ::testing::Test {
  std::string refusal(const std::string& bytes, const ArchiveLimits& limits = {}) {
    const fs::path into = folder.path() / "into";
    fs::remove_all(into);
    fs::create_directory(into);
    return message_of<InputError>([&] { unpack_archive(folder.write("archive", bytes), into, limits); });
  }
  TemporaryFolder folder;
};

TEST_F(ArchiveTest, UnpacksWhatGnuTarPacksInEveryFormat) {
  const std::string long_name = std::string(80, 'n') + "/" + std::string(80, 'm');
  folder.write("from/run.py", "#!/usr/bin/python3\n");
  folder.write("from/deep/" + long_name, "deep");
  ::chmod((folder.path() / "from/run.py").c_str(), 0755);
  for (const char* format : {"gnu", "ustar", "pax"}) {
    const std::string archive = (folder.path() / (std::string(format) + ".tar.gz")).string();
    ASSERT_EQ(
        std::system(
            ("tar -C " + folder.path().string() + "/from --format=" + format + " -czf " + archive + " .").c_str()),
        0);
    const fs::path into = folder.path() / format;
    fs::create_directory(into);
    unpack_archive(archive, into);
    EXPECT_EQ(folder.read(std::string(format) + "/deep/" + long_name), "deep") << format;
    EXPECT_NE(fs::status(into / "run.py").permissions() & fs::perms::owner_exec, fs::perms::none) << format;
    EXPECT_EQ(fs::status(into / "deep" / long_name).permissions() & fs::perms::owner_exec, fs::perms::none) << format;
  }
}

TEST_F(ArchiveTest, RefusesWhatIsNoFileAndNoFolder) {
  EXPECT_THAT(refusal(entry("l", "", '2') + kEnd), HasSubstr("'l' is a symbolic link"));
  EXPECT_THAT(refusal(entry("l", "", '1') + kEnd), HasSubstr("hard link"));
  EXPECT_THAT(refusal(entry("d", "", '3') + kEnd), HasSubstr("device"));
  EXPECT_THAT(refusal(entry("p", "", '6') + kEnd), HasSubstr("pipe"));
  EXPECT_THAT(refusal(entry("s", "", 'S') + kEnd), HasSubstr("not known"));
}

TEST_F(ArchiveTest, RefusesNamesThatLeadElsewhere) {
  for (const char* name : {"/etc/passwd", "../up", "a/../../up", "..", "a/.."})
    EXPECT_THAT(refusal(entry(name, "x") + kEnd), HasSubstr("leads outside")) << name;
  EXPECT_THAT(refusal(entry("x", pax("path", "../up"), 'x') + entry("good", "x") + kEnd), HasSubstr("leads outside"));
  EXPECT_THAT(refusal(entry("x", std::string("../up\0", 6), 'L') + entry("good", "x") + kEnd),
              HasSubstr("leads outside"));
  EXPECT_THAT(refusal(entry("new\nline", "x") + kEnd), HasSubstr("characters"));
  EXPECT_FALSE(fs::exists(folder.path() / "up"));
}

TEST_F(ArchiveTest, RefusesTheSameNameTwiceAndAFileAsAFolder) {
  EXPECT_THAT(refusal(entry("a", "1") + entry("./a", "2") + kEnd), HasSubstr("twice"));
  EXPECT_EQ(folder.read("into/a"), "1");
  EXPECT_THAT(refusal(entry("a", "1") + entry("a/b", "2") + kEnd), HasSubstr("'a/b': Not a directory"));
}

TEST_F(ArchiveTest, RefusesTooMuch) {
  EXPECT_THAT(refusal(entry("a", std::string(700, 'a')) + entry("b", std::string(700, 'b')) + kEnd, {1 << 10, 10}),
              HasSubstr("more than 0 MiB"));
  std::string many;
  for (int i = 0; i < 11; ++i) many += entry("d" + std::to_string(i), "", '5');
  EXPECT_THAT(refusal(many + kEnd, {1 << 20, 10}), HasSubstr("more than 10 entries"));
  std::string records;
  for (int i = 0; i < 50; ++i) records += entry("g", pax("comment", "x"), 'g');
  EXPECT_THAT(refusal(records + kEnd, {1 << 20, 10}), HasSubstr("more than 10 entries"));
  EXPECT_THAT(refusal(header("b", 10ULL << 30)), HasSubstr("more than 256 MiB"));
}

/// A gigabyte of zeros in a megabyte: never more than the limit is unpacked.
TEST_F(ArchiveTest, RefusesABombBeforeItIsUnpacked) {
  const fs::path bomb = folder.path() / "bomb.tar.gz", into = folder.path() / "into";
  fs::create_directory(into);
  gzFile out = ::gzopen(bomb.c_str(), "wb1");
  ::gzwrite(out, header("zeros", 1 << 30).data(), 512);
  const std::string zeros(1 << 20, '\0');
  for (int i = 0; i < 64; ++i) ::gzwrite(out, zeros.data(), static_cast<unsigned>(zeros.size()));
  ::gzclose(out);
  EXPECT_THAT(message_of<InputError>([&] {
                unpack_archive(bomb, into, {64 << 20, 10});
              }),
              HasSubstr("more than 64 MiB"));
  EXPECT_TRUE(fs::is_empty(into));
}

TEST_F(ArchiveTest, RefusesWhatIsCutOrNoArchive) {
  const std::string whole = entry("a", std::string(2000, 'a')) + kEnd;
  EXPECT_EQ(refusal(whole), "no error");
  EXPECT_THAT(refusal(whole.substr(0, 1024)), HasSubstr("cut short"));
  EXPECT_THAT(refusal(whole.substr(0, 100)), HasSubstr("cut short"));
  EXPECT_THAT(refusal(std::string(5000, 'x')), HasSubstr("archive"));
  EXPECT_THAT(refusal(""), HasSubstr("is empty"));
  EXPECT_THAT(refusal(kEnd), HasSubstr("is empty"));
}

/// Whatever one byte of a header or a record becomes, with the sum made right, nothing is written outside.
TEST_F(ArchiveTest, StaysInItsFolderWhateverIsDamaged) {
  const std::string whole =
      entry("x", pax("path", "abc/def"), 'x') + entry("good", "bytes") + entry("d", "", '5') + kEnd;
  for (std::size_t at = 0; at < whole.size() - kEnd.size(); ++at)
    for (const char c : {'\0', '/', '.', '2', '\xff'}) {
      if (whole[at] == '\0') continue;
      std::string damaged = whole;
      damaged[at] = c;
      const std::size_t block = at / 512 * 512;
      if (damaged.substr(block + 257, 5) == "ustar") damaged.replace(block, 512, summed(damaged.substr(block, 512)));
      refusal(damaged);
    }
  std::vector<std::string> names;
  for (const auto& one : fs::directory_iterator(folder.path())) names.push_back(one.path().filename().string());
  EXPECT_THAT(names, ::testing::UnorderedElementsAre("archive", "into"));
}

TEST_F(ArchiveTest, PacksWhatGnuTarUnpacks) {
  folder.write("from/session.yaml", "name: one\n");
  folder.write("from/frames/left/000001.png", std::string(1000, 'p'));
  const fs::path archive = folder.path() / "one.tar";
  pack_archive(folder.path() / "from", "one", archive);
  ASSERT_EQ(std::system(("tar -C " + folder.path().string() + " -xf " + archive.string()).c_str()), 0);
  EXPECT_EQ(folder.read("one/session.yaml"), "name: one\n");
  EXPECT_EQ(folder.read("one/frames/left/000001.png"), std::string(1000, 'p'));
}

}  // namespace
}  // namespace tankrig
