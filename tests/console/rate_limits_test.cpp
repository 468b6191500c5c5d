// How often one address may ask, and try a password, on a clock of the test's own.
#include "console/server/rate_limits.hpp"

#include <gtest/gtest.h>

#include "console/server/counted_address.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

struct RateLimits : ::testing::Test {
  int taken(RequestLimit& limit, const std::string& address, int asked) const {
    int n = 0;
    for (int i = 0; i < asked; ++i) n += limit.take(address, now) ? 1 : 0;
    return n;
  }
  std::chrono::steady_clock::time_point now{1h};
};

TEST_F(RateLimits, OfRequestsAreABucketThatFillsAgain) {
  RequestLimit limit(20, 10);
  EXPECT_EQ(taken(limit, "a", 30), 20);
  now += 500ms;
  EXPECT_EQ(taken(limit, "a", 30), 5);
  now += 1h;
  EXPECT_EQ(taken(limit, "a", 30), 20);
}

TEST_F(RateLimits, OfRequestsAreEachAddresssOwn) {
  RequestLimit limit(20, 10);
  EXPECT_EQ(taken(limit, "a", 30), 20);
  EXPECT_EQ(taken(limit, "b", 30), 20);
}

TEST_F(RateLimits, OfRequestsTakeNoEndlessMemory) {
  RequestLimit limit(20, 10);
  for (int i = 0; i < 4096; ++i) EXPECT_TRUE(limit.take(std::to_string(i), now));
  EXPECT_FALSE(limit.take("one more", now));
  EXPECT_TRUE(limit.take("7", now)) << "an address that is known is not pushed out";
  now += 1s;
  EXPECT_TRUE(limit.take("one more", now)) << "full buckets are forgotten";
}

TEST_F(RateLimits, CountANetworkOfIPv6AsOneAddress) {
  const auto counted = [](const char* address) { return counted_address(boost::asio::ip::make_address(address)); };
  EXPECT_EQ(counted("2001:db8:1:2::1"), counted("2001:db8:1:2:ffff:ffff:ffff:ffff"));
  EXPECT_NE(counted("2001:db8:1:2::1"), counted("2001:db8:1:3::1"));
  EXPECT_NE(counted("192.168.1.4"), counted("192.168.1.5"));
}

TEST_F(RateLimits, OfPasswordsGrowWithEachWrongOne) {
  LoginDelay delay;
  EXPECT_EQ(delay.left("a", now), 0s);
  for (const auto expected : {1s, 2s, 4s, 8s, 16s, 32s, 64s, 64s}) {
    delay.failed("a", now);
    EXPECT_EQ(delay.left("a", now), expected);
    EXPECT_EQ(delay.left("b", now), 0s);
    now += expected - 1ms;
    EXPECT_EQ(delay.left("a", now), 1s);
    now += 1ms;
    EXPECT_EQ(delay.left("a", now), 0s);
  }
}

TEST_F(RateLimits, OfPasswordsEndWithARightOneOrAnHour) {
  LoginDelay delay;
  for (int i = 0; i < 5; ++i) delay.failed("a", now);
  delay.succeeded("a");
  delay.failed("a", now);
  EXPECT_EQ(delay.left("a", now), 1s);
  for (int i = 0; i < 5; ++i) delay.failed("a", now);
  now += 61min;
  EXPECT_EQ(delay.left("a", now), 0s);
  delay.failed("a", now);
  EXPECT_EQ(delay.left("a", now), 1s);
}

}  // namespace
}  // namespace tankrig
