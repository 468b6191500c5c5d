// The platform's queue: what was entered survives, each is taken once, and the best stand first.
#include "console/platform/store.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <set>

#include "core/input_error.hpp"
#include "tests/support/temporary_folder.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

Submission sent(const std::string& id, std::int64_t received_s = 1000, const std::string& user = "ann") {
  Submission s;
  s.id = id, s.dataset = "tank", s.file = "cloud.ply", s.name = "'; DROP TABLE submissions; --", s.uses = "laser";
  s.user = user, s.address = "127.0.0.1", s.received_s = received_s, s.bytes = 10;
  return s;
}

struct StoreTest : ::testing::Test {
  TemporaryFolder folder;
  const fs::path place = folder.path() / "store";
};

TEST_F(StoreTest, TakesTheOldestOnceAndKeepsItsText) {
  Store store(place);
  store.add(sent("a"));
  store.add(sent("b"));
  EXPECT_EQ(store.before("b"), 1);
  const auto first = store.take(), second = store.take();
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->id, "a");
  EXPECT_EQ(first->name, "'; DROP TABLE submissions; --");
  EXPECT_EQ(first->state, "running");
  EXPECT_EQ(second->id, "b");
  EXPECT_FALSE(store.take());
  EXPECT_EQ(store.waiting(), 2);
}

TEST_F(StoreTest, EntersAllOfABatchOrNone) {
  Store store(place);
  store.add(std::vector{sent("a"), sent("b")});
  EXPECT_EQ(store.waiting(), 2);
  EXPECT_THROW(store.add(std::vector{sent("c"), sent("a")}), InputError) << "a name twice";
  EXPECT_EQ(store.waiting(), 2);
  EXPECT_FALSE(store.find("c"));
  store.add(std::vector<Submission>{});
  store.add(sent("c"));
  EXPECT_TRUE(store.find("c"));
}

TEST_F(StoreTest, WithdrawsWhatNobodyHasTaken) {
  Store store(place);
  store.add(sent("a"));
  store.add(sent("b"));
  store.take();
  EXPECT_FALSE(store.withdraw("a"));
  EXPECT_TRUE(store.withdraw("b"));
  EXPECT_FALSE(store.withdraw("b"));
  EXPECT_TRUE(store.find("a"));
  EXPECT_FALSE(store.find("b"));
}

TEST_F(StoreTest, RanksWhatIsDone) {
  Store store(place);
  for (const auto& [id, rank] :
       {std::pair{"low", 0.1}, std::pair{"high", 0.9}, std::pair{"middle", 0.5}, std::pair{"none", 0.95}}) {
    store.add(sent(id));
    Submission s = *store.take();
    s.state = s.id == "none" ? "failed" : "done", s.rank = rank, s.figures = "{}";
    store.finish(s);
  }
  std::string order;
  for (const Submission& s : store.best("tank", 10)) order += s.id + " ";
  EXPECT_EQ(order, "high middle low ");
  EXPECT_EQ(store.best("tank", 2).size(), 2U);
  EXPECT_EQ(store.newest("tank", 10).size(), 4U);
  EXPECT_EQ(store.best("other", 10).size(), 0U);
}

/// What runs when the server is killed runs again; the second time it has failed.
TEST_F(StoreTest, SurvivesKillsOfItsServer) {
  const auto killed_server = [&](int adds) {
    const pid_t server = ::fork();
    if (server == 0) {
      Store store(place);
      for (int i = 0; i < adds; ++i) store.add(sent(std::to_string(i)));
      store.take();
      ::kill(::getpid(), SIGKILL);
    }
    int status = 0;
    ::waitpid(server, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status));
  };
  killed_server(3);
  fs::create_directories(place / "submissions" / "stray");
  {
    const Store store(place);
    EXPECT_EQ(store.find("0")->state, "queued");
    EXPECT_EQ(store.waiting(), 3);
    EXPECT_FALSE(fs::exists(place / "submissions" / "stray"));
  }
  killed_server(0);
  Store store(place);
  EXPECT_EQ(store.find("0")->state, "failed");
  EXPECT_EQ(store.find("0")->message, "the server ended twice while this was scored");
  EXPECT_EQ(store.take()->id, "1");
}

TEST_F(StoreTest, DoesNotCountAnOrderlyEndAsATry) {
  for (int i = 0; i < 4; ++i) {
    Store store(place);
    if (i == 0) store.add(sent("a"));
    ASSERT_TRUE(store.take()) << i;
    store.put_back();
  }
}

TEST_F(StoreTest, CountsWhatSomebodyHasSentWithinAnHour) {
  Store store(place);
  for (const auto& [id, at] : {std::pair{"a", 100}, std::pair{"b", 200}, std::pair{"c", 300}}) store.add(sent(id, at));
  store.add(sent("d", 300, "bob"));
  const Usage ann = store.usage(Store::Whose::kUser, "ann", 150);
  EXPECT_EQ(ann.uploads, 2);
  EXPECT_EQ(ann.bytes, 20U);
  EXPECT_EQ(ann.waiting, 3);
  EXPECT_EQ(ann.oldest_s, 200);
  EXPECT_EQ(store.usage(Store::Whose::kAddress, "127.0.0.1", 0).uploads, 4);
}

TEST_F(StoreTest, NamesAreLongAndDiffer) {
  std::set<std::string> ids;
  for (int i = 0; i < 1000; ++i) ids.insert(Store::new_id());
  EXPECT_EQ(ids.size(), 1000U);
  EXPECT_EQ(ids.begin()->size(), 16U);
}

TEST_F(StoreTest, ADatabaseThatIsNoneIsNamed) {
  folder.write("store/platform.db", std::string(4096, 'x'));
  EXPECT_NE(message_of<std::exception>([&] { Store store(place); }).find("platform.db: "), std::string::npos);
}

}  // namespace
}  // namespace tankrig
