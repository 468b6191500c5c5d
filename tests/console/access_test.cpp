// The console's key: only a page of its own, on a browser that was let in, is heard.
#include "console/server/access.hpp"

#include <gtest/gtest.h>

#include "console/server/control.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

struct AccessTest : ::testing::Test {
  /// What stands in the way; empty: nothing does.
  static std::string refused(Access& access, const RequestHeaders& request) {
    const std::string why = access.refused(request);
    return !why.empty() ? why : access.session(request) ? "" : "not let in";
  }
  std::string refused(const RequestHeaders& request) { return refused(access, request); }

  Access access{{}, 8080};
  const std::string cookie = "tankrig_8080=" + access.key();
};

TEST_F(AccessTest, LetsInWhoeverHasItsKey) {
  EXPECT_EQ(refused({"127.0.0.1:8080", "", cookie}), "");
  EXPECT_EQ(refused({"localhost:8080", "http://localhost:8080", "a=b; " + cookie + "; c=d", true}), "");
  EXPECT_TRUE(access.opens(access.key()));
  EXPECT_EQ(access.key().size(), 32U);
  EXPECT_EQ(access.session({"", "", cookie})->role(), Role::kAdminister);
}

TEST_F(AccessTest, RefusesWithoutTheKey) {
  for (const std::string& bad : {std::string(), std::string("tankrig_8080="), "tankrig_8080=" + std::string(32, '0'),
                                 cookie + "0", "tankrig_8081=" + access.key(), "xtankrig_8080=" + access.key()})
    EXPECT_NE(refused({"127.0.0.1:8080", "", bad}), "") << bad;
  EXPECT_FALSE(access.opens(""));
}

TEST_F(AccessTest, RefusesOtherNamesAndOtherPages) {
  for (const char* host : {"", "evil.example:8080", "127.0.0.1", "127.0.0.1:80", "127.0.0.1.evil.example:8080"})
    EXPECT_NE(refused({host, "", cookie}), "") << host;
  for (const char* origin :
       {"http://evil.example", "null", "https://127.0.0.1:8080", "http://127.0.0.1:8081", "http://localhost:8080"})
    EXPECT_NE(refused({"127.0.0.1:8080", origin, cookie, true}), "") << origin;
}

TEST_F(AccessTest, RefusesAWebSocketThatNoPageOpened) { EXPECT_NE(refused({"127.0.0.1:8080", "", cookie, true}), ""); }

TEST_F(AccessTest, IsAskedUnderItsNamesOrTheAddressThatWasReached) {
  Access there({.address = "0.0.0.0", .names = {"tank.lab"}, .users = "users", .tls_certificate = "c"}, 443);
  const std::string let_in = there.let_in("anna", Role::kWatch), user = let_in.substr(0, let_in.find(';'));
  const char here[] = "192.168.1.5";
  for (const char* host : {"tank.lab:443", "tank.lab", "192.168.1.5:443", "192.168.1.5"}) {
    EXPECT_EQ(refused(there, {host, "", user, false, "", here}), "") << host;
    EXPECT_EQ(refused(there, {host, std::string("https://") + host, user, true, "", here}), "") << host;
    EXPECT_NE(refused(there, {host, std::string("http://") + host, user, true, "", here}), "") << host;
  }
  for (const char* host :
       {"localhost", "127.0.0.1", "192.168.1.6", "evil.example", "tank.lab.evil.example", "tank.lab:80"})
    EXPECT_NE(refused(there, {host, "", user, false, "", here}), "") << host;
}

TEST_F(AccessTest, GivesAnIpV6AddressItsBrackets) {
  Access there({.address = "::1"}, 8080);
  const std::string key = "tankrig_8080=" + there.key();
  EXPECT_EQ(there.address(), "http://[::1]:8080/?key=" + there.key());
  EXPECT_EQ(refused(there, {"[::1]:8080", "http://[::1]:8080", key, true, "", "::1"}), "");
}

struct UsersTest : AccessTest {
  static std::string token_of(const std::string& cookie) { return cookie.substr(0, cookie.find(';')); }
  Access users{{.users = "users", .tls_certificate = "c"}, 8080};
};

TEST_F(UsersTest, HaveTheirRoleAndNoKey) {
  const std::string cookie_of_anna = users.let_in("anna", Role::kOperate);
  const auto session = users.session({"", "", token_of(cookie_of_anna)});
  ASSERT_TRUE(session);
  EXPECT_EQ(session->name(), "anna");
  EXPECT_EQ(session->role(), Role::kOperate);
  EXPECT_TRUE(cookie_of_anna.ends_with("; Path=/; HttpOnly; SameSite=Strict; Secure")) << cookie_of_anna;
  EXPECT_FALSE(users.session({"", "", "tankrig_8080="}));
  EXPECT_FALSE(users.opens(""));
  EXPECT_EQ(users.address(), "https://127.0.0.1:8080/");
}

TEST_F(UsersTest, AreLetOutWhenTheirSessionEnds) {
  const std::string token = token_of(users.let_in("anna", Role::kOperate));
  const auto session = users.session({"", "", token});
  EXPECT_FALSE(session->over());
  EXPECT_TRUE(session->over(BrowserSession::Clock::now() + std::chrono::hours(13)));
  session->end();
  EXPECT_FALSE(users.session({"", "", token}));
}

TEST_F(UsersTest, PushOutOnlyTheirOwnOldestSession) {
  const std::string others = token_of(users.let_in("ben", Role::kOperate));
  const std::string first = token_of(users.let_in("anna", Role::kWatch));
  const auto session = users.session({"", "", first});
  for (int i = 0; i < 16; ++i) users.let_in("anna", Role::kWatch);
  EXPECT_FALSE(users.session({"", "", first}));
  EXPECT_TRUE(session->over());
  EXPECT_TRUE(users.session({"", "", others}));
}

struct TokensTest : AccessTest {
  void write(Role role, const std::vector<ApiToken>& tokens) const {
    write_users(file, {{"anna", role, {.salt = std::string(16, 's'), .hash = std::string(32, 'h')}, tokens}});
  }
  std::shared_ptr<BrowserSession> asks(const std::string& by, bool upgrade = false) {
    return users.session({"", "", "", upgrade, by});
  }
  TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "users";
  const std::string token = new_token();
  Access users{{.users = file}, 8080};
};

TEST_F(TokensTest, LetInAProgramOfTheirUserAtMostAsTheUser) {
  write(Role::kOperate, {{"laptop", Role::kOperate, token_hash(token)}});
  const auto session = asks("Bearer " + token);
  ASSERT_TRUE(session);
  EXPECT_EQ(session->name(), "anna");
  EXPECT_EQ(session->role(), Role::kOperate);
  write(Role::kAdminister, {{"laptop", Role::kWatch, token_hash(token)}});
  EXPECT_EQ(asks("Bearer " + token)->role(), Role::kWatch);
  write(Role::kWatch, {{"laptop", Role::kAdminister, token_hash(token)}});
  EXPECT_EQ(asks("Bearer " + token)->role(), Role::kWatch);
}

TEST_F(TokensTest, AreUnknownOnceTheyAreRevoked) {
  write(Role::kOperate, {{"laptop", Role::kOperate, token_hash(token)}, {"lab", Role::kOperate, token_hash("other")}});
  EXPECT_TRUE(asks("Bearer " + token));
  write(Role::kOperate, {{"lab", Role::kOperate, token_hash("other")}});
  EXPECT_FALSE(asks("Bearer " + token));
  EXPECT_TRUE(asks("Bearer other"));
  std::filesystem::remove(file);
  EXPECT_FALSE(asks("Bearer other"));
}

TEST_F(TokensTest, AreNoCookiesAndOpenNoWebSocket) {
  write(Role::kOperate, {{"laptop", Role::kOperate, token_hash(token)}});
  EXPECT_FALSE(asks("Bearer " + token, true));
  EXPECT_FALSE(users.session({"", "", "tankrig_8080=" + token}));
  const std::string cookie_of_anna = users.let_in("anna", Role::kOperate),
                    login = cookie_of_anna.substr(0, cookie_of_anna.find(';'));
  EXPECT_TRUE(users.session({"", "", login}));
  EXPECT_FALSE(asks("Bearer " + login.substr(login.find('=') + 1)));
  for (const std::string& wrong : {std::string(), std::string("Bearer "), "Bearer " + token + "0", "bearer " + token,
                                   "Bearer " + token_hash(token), token})
    EXPECT_FALSE(asks(wrong)) << wrong;
}

TEST(AccessKey, IsAnotherEachTime) { EXPECT_NE(Access({}, 1).key(), Access({}, 1).key()); }

TEST(Control, HasOneHolder) {
  Control control;
  EXPECT_TRUE(control.take(1));
  EXPECT_TRUE(control.take(1));
  EXPECT_FALSE(control.take(2));
  EXPECT_TRUE(control.holds(1));
  EXPECT_FALSE(control.holds(2));
}

TEST(Control, IsHandedOverOnlyByItsHolder) {
  Control control;
  control.take(1);
  control.offer(2);
  EXPECT_FALSE(control.take(2));
  control.offer(1);
  EXPECT_TRUE(control.take(2));
  EXPECT_FALSE(control.offered());
  EXPECT_FALSE(control.take(1));
}

TEST(Control, IsLostByItsHolderAlone) {
  Control control;
  control.take(1);
  EXPECT_FALSE(control.lose(2));
  EXPECT_TRUE(control.lose(1));
  EXPECT_FALSE(control.lose(1));
  EXPECT_TRUE(control.take(2));
}

}  // namespace
}  // namespace tankrig
