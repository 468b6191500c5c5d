// Uploads reach the disk beside the server: each is told once, with its file in its folder.
#include "console/platform/arrivals.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/executor_work_guard.hpp>
#include <map>
#include <optional>
#include <thread>

#include "core/text_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

struct ArrivalsTest : ::testing::Test {
  ArrivalsTest() { fs::create_directory(folder.path() / "submissions"); }

  fs::path place_of(const std::string& id) const { return folder.path() / "submissions" / id; }
  std::shared_ptr<Arriving> sent(const std::string& id, const std::string& text) const {
    Submission s;
    s.id = id, s.file = "cloud.ply";
    auto arriving = std::make_shared<Arriving>(s, folder.path() / id);
    std::string_view bytes = text;
    write_all(arriving->file.path(), arriving->file.descriptor(), bytes);
    return arriving;
  }

  TemporaryFolder folder;
  boost::asio::io_context io;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work = boost::asio::make_work_guard(io);
  std::map<std::string, std::string> told;  // why not, by id
  std::size_t batches = 0;
};

TEST_F(ArrivalsTest, TellsEachOnceInTheServersThread) {
  constexpr int kMany = 100;
  const auto here = std::this_thread::get_id();
  std::optional<Arrivals> arrivals;
  arrivals.emplace(
      io, folder.path(), [this](const std::string& id) { return place_of(id); },
      [&](Arrivals::Batch batch) {
        EXPECT_EQ(std::this_thread::get_id(), here);
        ++batches;
        arrivals->confirm(std::move(batch));
      });
  for (int i = 0; i < kMany; ++i)
    arrivals->bring(sent(std::to_string(i), "number " + std::to_string(i)), [&](const Arrivals::Brought& one) {
      EXPECT_TRUE(told.emplace(one.upload->submission.id, one.why_not).second);
      if (told.size() == kMany) io.stop();
    });
  io.run();
  EXPECT_LT(batches, kMany) << "each waited for a sync of its own";
  for (int i = 0; i < kMany; ++i) {
    const std::string id = std::to_string(i);
    EXPECT_EQ(told.at(id), "");
    EXPECT_EQ(read_whole_file(place_of(id) / "cloud.ply"), "number " + id);
  }
  for (const auto& entry : fs::directory_iterator(folder.path()))
    EXPECT_TRUE(entry.is_directory()) << entry.path() << " is left";
}

TEST_F(ArrivalsTest, OneThatCannotBePlacedTakesNoOtherAlong) {
  Arrivals arrivals(
      io, folder.path(),
      [this](const std::string& id) { return id == "lost" ? folder.path() / "none" / id : place_of(id); },
      [&](Arrivals::Batch batch) {
        for (const auto& one : batch) one.done(one);
      });
  for (const char* id : {"a", "lost", "b"})
    arrivals.bring(sent(id, id), [&](const Arrivals::Brought& one) {
      told[one.upload->submission.id] = one.why_not;
      if (told.size() == 3) io.stop();
    });
  io.run();
  EXPECT_EQ(told.at("a") + told.at("b"), "");
  EXPECT_THAT(told.at("lost"), ::testing::HasSubstr("none"));
}

TEST_F(ArrivalsTest, EndsWithUploadsThatStillWait) {
  {
    Arrivals arrivals(
        io, folder.path(), [this](const std::string& id) { return place_of(id); }, [](const Arrivals::Batch&) {});
    for (int i = 0; i < 20; ++i)
      arrivals.bring(sent(std::to_string(i), "x"), [](const Arrivals::Brought&) { ADD_FAILURE() << "told"; });
  }
  io.poll();
}

}  // namespace
}  // namespace tankrig
