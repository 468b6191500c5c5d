// The console's key: only a page of its own, on a browser that was let in, is heard.
#include "console/server/access.hpp"

#include <gtest/gtest.h>

#include "console/server/control.hpp"

namespace tankrig {
namespace {

struct AccessTest : ::testing::Test {
  const Access access{8080};
  const std::string cookie = "tankrig_8080=" + access.key();
};

TEST_F(AccessTest, LetsInWhoeverHasItsKey) {
  EXPECT_EQ(access.refused({"127.0.0.1:8080", "", cookie}), "");
  EXPECT_EQ(access.refused({"localhost:8080", "http://localhost:8080", "a=b; " + cookie + "; c=d", true}), "");
  EXPECT_TRUE(access.opens(access.key()));
  EXPECT_EQ(access.key().size(), 32U);
}

TEST_F(AccessTest, RefusesWithoutTheKey) {
  for (const std::string& bad : {std::string(), std::string("tankrig_8080="), "tankrig_8080=" + std::string(32, '0'),
                                 cookie + "0", "tankrig_8081=" + access.key(), "xtankrig_8080=" + access.key()})
    EXPECT_NE(access.refused({"127.0.0.1:8080", "", bad}), "") << bad;
  EXPECT_FALSE(access.opens(""));
}

TEST_F(AccessTest, RefusesOtherNamesAndOtherPages) {
  for (const char* host : {"", "evil.example:8080", "127.0.0.1", "127.0.0.1:80", "127.0.0.1.evil.example:8080"})
    EXPECT_NE(access.refused({host, "", cookie}), "") << host;
  for (const char* origin :
       {"http://evil.example", "null", "https://127.0.0.1:8080", "http://127.0.0.1:8081", "http://localhost:8080"})
    EXPECT_NE(access.refused({"127.0.0.1:8080", origin, cookie, true}), "") << origin;
}

TEST_F(AccessTest, RefusesAWebSocketThatNoPageOpened) {
  EXPECT_NE(access.refused({"127.0.0.1:8080", "", cookie, true}), "");
}

TEST(AccessKey, IsAnotherEachTime) { EXPECT_NE(Access(1).key(), Access(1).key()); }

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
