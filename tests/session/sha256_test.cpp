// SHA-256 against the vectors NIST publishes, and the seal on a session.
#include "session/checking/sha256.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/atomic_file.hpp"
#include "core/input_error.hpp"
#include "session/checking/checksums.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

TEST(Sha256, AgreesWithTheVectorsOfNist) {
  EXPECT_EQ(sha256_of_text(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256_of_text("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_of_text("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256_of_text(std::string(1000000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, OfAFileIsThatOfItsBytes) {
  const TemporaryFolder folder;
  std::string text;
  for (int i = 0; i < 200'000; ++i) text += static_cast<char>(i * 7 + i / 251);
  EXPECT_EQ(sha256_of_file(folder.write("long", text)), sha256_of_text(text));
  EXPECT_EQ(sha256_of_file(folder.write("empty", "")), sha256_of_text(""));
}

TEST(Checksums, ListEveryFileOnceInOrderAndFindWhatChanged) {
  const TemporaryFolder folder;
  folder.write("b.txt", "abc");
  folder.write("a/z.txt", "");
  folder.write("a.txt", "x");
  write_checksums(folder.path());
  const std::string sums = folder.read("SHA256SUMS");
  EXPECT_NE(sums.find("ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad  b.txt\n"), std::string::npos);
  EXPECT_LT(sums.find("a.txt"), sums.find("a/z.txt"));
  EXPECT_TRUE(compare_checksums(folder.path()).empty());

  folder.write("b.txt", "abd");
  folder.write("new.txt", "");
  std::filesystem::remove(folder.path() / "a.txt");
  std::vector<std::string> differences;
  for (const ChecksumDifference& difference : compare_checksums(folder.path()))
    differences.push_back(in_words(difference));
  EXPECT_THAT(differences, testing::ElementsAre("b.txt: changed", "new.txt: not listed", "a.txt: missing"));
}

TEST(Checksums, KnowNoFileThatIsNotFinished) {
  const TemporaryFolder folder;
  folder.write("a.txt", "x");
  folder.write("x.yaml" + std::string(kUnfinished), "half of it");
  write_checksums(folder.path());
  EXPECT_EQ(folder.read("SHA256SUMS"), sha256_of_text("x") + "  a.txt\n");
  folder.write("a/y.ply" + std::string(kUnfinished), "made since");
  EXPECT_THAT(compare_checksums(folder.path()), testing::IsEmpty());
}

TEST(Checksums, RefuseAMalformedListWithItsLine) {
  const TemporaryFolder folder;
  folder.write("SHA256SUMS", "hello\n");
  EXPECT_THAT(message_of<InputError>([&] { compare_checksums(folder.path()); }),
              testing::HasSubstr("SHA256SUMS:1: found 'hello', expected 64 hexadecimal digits"));
  for (const char* outside : {"../../etc/passwd", "/etc/passwd", "frames/../../x"}) {
    folder.write("SHA256SUMS", std::string(64, '0') + "  " + outside + "\n");
    EXPECT_THAT(
        message_of<InputError>([&] { compare_checksums(folder.path()); }),
        testing::HasSubstr("SHA256SUMS:1: found '" + std::string(outside) + "', expected a file of the session"));
  }
}

}  // namespace
}  // namespace tankrig
