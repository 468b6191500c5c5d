// The console's users: a password is found again, and every bad line of their file is named.
#include "console/server/users.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <boost/asio/io_context.hpp>
#include <optional>

#include "console/server/password_check.hpp"
#include "core/input_error.hpp"
#include "core/text_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

using ::testing::HasSubstr;

constexpr char kPassword[] = "correct horse";
const std::string kSalt(32, '0'), kHash(64, 'a'), kGood = "anna operate scrypt 15 8 3 " + kSalt + " " + kHash;

struct UsersFile : ::testing::Test {
  fs::path written(const std::string& text, fs::perms mode = fs::perms::owner_read | fs::perms::owner_write) const {
    folder.write("users", text);
    fs::permissions(file, mode);
    return file;
  }
  std::string refusal(const std::string& text) const {
    try {
      read_users(written(text));
    } catch (const InputError& e) {
      return e.what();
    }
    return "taken";
  }
  TemporaryFolder folder;
  const fs::path file = folder.path() / "users";
};

TEST(Password, IsFoundAgain) {
  const PasswordHash hash = hash_password(kPassword);
  EXPECT_TRUE(matches(hash, kPassword));
  for (const char* wrong : {"", "correct horsf", "correct horse ", "Correct horse"})
    EXPECT_FALSE(matches(hash, wrong)) << wrong;
  EXPECT_NE(hash.salt, hash_password(kPassword).salt);
  EXPECT_FALSE(matches(nobodys_hash(), ""));
}

TEST(Password, IsHashedByTheStandardsScrypt) {  // RFC 7914, section 12
  PasswordHash hash{.log2_n = 14, .r = 8, .p = 1, .salt = "SodiumChloride", .hash = {}};
  for (const unsigned char byte :
       {0x70, 0x23, 0xbd, 0xcb, 0x3a, 0xfd, 0x73, 0x48, 0x46, 0x1c, 0x06, 0xcd, 0x81, 0xfd, 0x38, 0xeb,
        0xfd, 0xa8, 0xfb, 0xba, 0x90, 0x4f, 0x8e, 0x3e, 0xa9, 0xb5, 0x43, 0xf6, 0x54, 0x5d, 0xa1, 0xf2})
    hash.hash += static_cast<char>(byte);
  EXPECT_TRUE(matches(hash, "pleaseletmein"));
}

TEST(Password, IsNeitherShortNorEndless) {
  EXPECT_THROW(hash_password("ninebytes"), InputError);
  EXPECT_THROW(hash_password(std::string(201, 'x')), InputError);
}

TEST(Password, IsTriedBesideTheServer) {
  const PasswordHash hash = hash_password(kPassword);
  for (const bool right : {true, false}) {
    boost::asio::io_context io;
    std::optional<bool> said;
    check_password(io, hash, right ? kPassword : "wrong horse", [&](bool found) { said = found; });
    EXPECT_FALSE(said);
    io.run();
    EXPECT_EQ(said, right);
  }
}

TEST_F(UsersFile, IsReadAsItWasWrittenAndByItsOwnerAlone) {
  const std::vector<User> users{{"anna", Role::kOperate, hash_password(kPassword)},
                                {"ben-2", Role::kWatch, hash_password("another one")}};
  write_users(file, users);
  struct stat facts {};
  ASSERT_EQ(::stat(file.c_str(), &facts), 0);
  EXPECT_EQ(facts.st_mode & 07777, 0600U);
  const std::vector<User> read = read_users(file);
  ASSERT_EQ(read.size(), 2U);
  EXPECT_EQ(read[0].name, "anna");
  EXPECT_EQ(read[1].role, Role::kWatch);
  EXPECT_TRUE(matches(read[0].password, kPassword));
  EXPECT_FALSE(matches(read[1].password, kPassword));
}

TEST(Token, IsRandomAndHashedByTheStandardsSha256) {  // FIPS 180-2, B.1
  EXPECT_EQ(new_token().size(), std::string("tankrig-").size() + 40);
  EXPECT_NE(new_token(), new_token());
  std::string hash;
  for (const unsigned char byte :
       {0xba, 0x78, 0x16, 0xbf, 0x8f, 0x01, 0xcf, 0xea, 0x41, 0x41, 0x40, 0xde, 0x5d, 0xae, 0x22, 0x23,
        0xb0, 0x03, 0x61, 0xa3, 0x96, 0x17, 0x7a, 0x9c, 0xb4, 0x10, 0xff, 0x61, 0xf2, 0x00, 0x15, 0xad})
    hash += static_cast<char>(byte);
  EXPECT_EQ(token_hash("abc"), hash);
}

TEST_F(UsersFile, KeepsTokensWithTheirUserAndNotThemselves) {
  const std::string token = new_token();
  write_users(file, {{"anna", Role::kOperate, hash_password(kPassword), {{"laptop", Role::kWatch, token_hash(token)}}},
                     {"ben", Role::kWatch, hash_password(kPassword)}});
  EXPECT_THAT(read_whole_file(file), ::testing::Not(HasSubstr(token)));
  const std::vector<User> read = read_users(file);
  ASSERT_EQ(read.size(), 2U);
  ASSERT_EQ(read[0].tokens.size(), 1U);
  EXPECT_EQ(read[0].tokens[0].label, "laptop");
  EXPECT_EQ(read[0].tokens[0].role, Role::kWatch);
  EXPECT_EQ(read[0].tokens[0].sha256, token_hash(token));
  EXPECT_TRUE(read[1].tokens.empty());
}

TEST_F(UsersFile, NamesEachBadToken) {
  const std::string good = "anna token laptop watch sha256 " + kHash;
  const auto refusal_of = [&](const std::string& line) { return refusal(kGood + "\n" + line + "\n"); };
  EXPECT_EQ(refusal_of(good), "taken");
  std::string many;
  for (int i = 0; i < 17; ++i) many += "anna token t" + std::to_string(i) + " watch sha256 " + kHash + "\n";
  EXPECT_THAT(refusal_of(many), HasSubstr("users:18: found more tokens of anna, expected at most 16"));
  for (const auto& [line, expected] : std::vector<std::pair<std::string, std::string>>{
           {"anna token laptop watch sha256", "found 5 words, expected NAME token LABEL ROLE sha256 HASH"},
           {"ben token laptop watch sha256 " + kHash, "found a token of ben, expected a line of this user above it"},
           {"anna token Laptop watch sha256 " + kHash, "found the name 'Laptop'"},
           {"anna token laptop root sha256 " + kHash, "found the role 'root'"},
           {"anna token laptop watch md5 " + kHash, "found 'md5' and 64 characters, expected sha256"},
           {"anna token laptop watch sha256 " + kHash.substr(2), "found 'sha256' and 62 characters"}}) {
    const std::string why = refusal_of(line);
    EXPECT_THAT(why, HasSubstr("users:2: " + expected));
    EXPECT_THAT(why, ::testing::Not(HasSubstr(kHash.substr(0, 20)))) << "shows a hash";
  }
  EXPECT_THAT(refusal_of(good + "\n" + good), HasSubstr("users:3: found anna's token laptop twice"));
}

TEST_F(UsersFile, MayHaveCommentsAndEmptyLines) {
  EXPECT_EQ(read_users(written("# users\n\n" + kGood + " # the first\n")).size(), 1U);
  EXPECT_TRUE(read_users(written("")).empty());
}

TEST_F(UsersFile, NamesEachBadLine) {
  const auto with = [](const std::string& from, const std::string& to) {
    std::string line = kGood;
    line.replace(line.find(from), from.size(), to);
    return "# users\n" + line + "\n";
  };
  EXPECT_EQ(refusal("# users\n" + kGood + "\n"), "taken");
  for (const auto& [text, expected] : std::vector<std::pair<std::string, std::string>>{
           {with("anna ", ""), "found 7 words, expected NAME ROLE scrypt LOG2_N R P SALT HASH"},
           {with("anna", "Anna"), "found the name 'Anna', expected a lower-case letter"},
           {with("anna", "../a"), "found the name '../a'"},
           {with("anna", std::string(33, 'b')), "found the name 'bbb"},
           {with("operate", "root"), "found the role 'root', expected one of: watch, operate, administer"},
           {with("scrypt", "md5"), "found 'md5', expected scrypt"},
           {with("15", "30"), "found scrypt 30 8 3"},
           {with("15", "1e1"), "found scrypt 1e1 8 3"},
           {with(" 8 ", " 0 "), "found scrypt 15 0 3"},
           {with(" 3 ", " -1 "), "found scrypt 15 8 -1"},
           {with(kSalt, "00"), "found salt and hash of 2 and 64 characters, expected 32 and 64 hexadecimal digits"},
           {with(kHash, kHash.substr(1) + "g"), "found salt and hash of 32 and 64 characters"}}) {
    const std::string why = refusal(text);
    EXPECT_THAT(why, HasSubstr("users:2: " + expected));
    EXPECT_EQ(why.find('\n'), std::string::npos) << why;
    EXPECT_THAT(why, ::testing::Not(HasSubstr(kHash.substr(0, 20)))) << "shows a hash";
  }
  EXPECT_THAT(refusal(kGood + "\n" + kGood + "\n"), HasSubstr("users:2: found anna twice"));
}

TEST_F(UsersFile, IsRefusedIfOthersMayReadIt) {
  written(kGood, fs::perms::owner_read | fs::perms::group_read);
  try {
    read_users(file);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("found mode 0440, expected 0600"));
  }
  EXPECT_THROW(read_users(folder.path() / "none"), InputError);
}

}  // namespace
}  // namespace tankrig
