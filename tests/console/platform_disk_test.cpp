// A disk that fails the platform between an upload's row and its answer: what is said is what is so.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <cerrno>
#include <functional>
#include <future>
#include <mutex>
#include <thread>

#include "console/platform/platform.hpp"
#include "console/platform/store.hpp"
#include "core/text_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

std::atomic<int> syncs_until_failure{-1};  // negative: none fails
std::mutex after_sync_mutex;
std::function<void()> after_sync;  // guarded by it

}  // namespace

/// In place of the C library's.
extern "C" int syncfs(int descriptor) {
  if (syncs_until_failure >= 0 && syncs_until_failure-- == 0) {
    errno = EIO;
    return -1;
  }
  const int result = static_cast<int>(::syscall(SYS_syncfs, descriptor));
  const std::scoped_lock lock(after_sync_mutex);
  if (after_sync) after_sync();
  return result;
}

namespace fs = std::filesystem;
namespace asio = boost::asio;

namespace tankrig {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

/// A platform whose scores take until the test's end.
class PlatformDiskTest : public ::testing::Test {
 protected:
  PlatformDiskTest() {
    const fs::path pipe = folder_.path() / "pipe",
                   program = folder_.write("program", "#!/bin/sh\nexec cat " + pipe.string() + "\n");
    ::chmod(program.c_str(), 0755);
    ::mkfifo(pipe.c_str(), 0600);
    held_ = ::open(pipe.c_str(), O_RDWR | O_CLOEXEC);
    fs::create_directory(folder_.path() / "store");
    options_.program = program.string();
    options_.store = folder_.path() / "store";
    options_.datasets = {{"tank", folder_.path(), folder_.path() / "tank.tar", true, false, {}}};
    options_.free_bytes = 0;
    options_.listen.port = 0;
    std::promise<std::string> ready;
    server_ = std::thread([this, &ready] {
      try {
        serve_platform(
            options_, [&](const std::string& address) { ready.set_value(address); }, [this] { return over_.load(); });
      } catch (...) {
        ready.set_exception(std::current_exception());
      }
    });
    const std::string address = ready.get_future().get();  // http://127.0.0.1:PORT/?key=KEY
    const auto colon = address.rfind(':'), slash = address.find('/', colon);
    port_ = static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1, slash - colon - 1)));
    key_ = address.substr(address.find("key=") + 4);
  }
  ~PlatformDiskTest() override {
    syncs_until_failure = -1;
    do_after_sync({});
    ::close(held_);
    over_ = true;
    server_.join();
  }

  static void do_after_sync(std::function<void()> what) {
    const std::scoped_lock lock(after_sync_mutex);
    after_sync = std::move(what);
  }

  std::string asked(const std::string& request, const std::string& body = "") {
    asio::io_context io;
    asio::ip::tcp::socket socket(io);
    socket.connect({asio::ip::make_address("127.0.0.1"), port_});
    asio::write(socket, asio::buffer(request + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port_) +
                                     "\r\nConnection: close\r\nAuthorization: Bearer " + key_ +
                                     "\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body));
    std::string heard;
    boost::system::error_code end;
    asio::read(socket, asio::dynamic_buffer(heard), end);
    return heard;
  }
  std::string send(const std::string& name) { return asked("POST /api/clouds?dataset=tank&name=" + name, "ply\n"); }
  std::string newest() { return asked("GET /api/datasets/tank"); }
  std::size_t folders() const {
    const fs::directory_iterator all(options_.store / "submissions");
    return static_cast<std::size_t>(std::distance(begin(all), end(all)));
  }

  TemporaryFolder folder_;
  PlatformOptions options_;
  int held_ = -1;
  std::atomic<bool> over_{false};
  std::thread server_;
  std::uint16_t port_ = 0;
  std::string key_;
};

TEST_F(PlatformDiskTest, WhoIsToldOfAFailureHasSentNothing) {
  ASSERT_THAT(send("first"), StartsWith("HTTP/1.1 202 "));
  syncs_until_failure = 1;  // after the second one's row
  EXPECT_THAT(send("second"), StartsWith("HTTP/1.1 507 "));
  EXPECT_THAT(newest(), AllOf(HasSubstr("first"), Not(HasSubstr("second"))));
  EXPECT_EQ(folders(), 1U);
  syncs_until_failure = 0;  // before the third one's
  EXPECT_THAT(send("third"), StartsWith("HTTP/1.1 507 "));
  EXPECT_THAT(newest(), Not(HasSubstr("third")));
  EXPECT_EQ(folders(), 1U);
  EXPECT_THAT(send("fourth"), StartsWith("HTTP/1.1 202 "));
  EXPECT_THAT(newest(), HasSubstr("fourth"));
}

TEST_F(PlatformDiskTest, WhatWasAnsweredIsThereAfterAPowerCut) {
  const fs::path cut = folder_.path() / "after_the_cut";
  const fs::path& store = options_.store;
  do_after_sync([&] {  // all that is written later is lost
    fs::remove_all(cut);
    fs::create_directory(cut);
    for (const char* part : {"platform.db", "platform.db-wal", "submissions"})
      if (fs::exists(store / part)) fs::copy(store / part, cut / part, fs::copy_options::recursive);
  });
  for (const char* name : {"first", "second", "third"}) ASSERT_THAT(send(name), StartsWith("HTTP/1.1 202 "));
  do_after_sync({});
  const Store left(cut);
  const std::vector<Submission> newest = left.newest("tank", 10);
  EXPECT_EQ(newest.size(), 3U);
  for (const Submission& s : newest) EXPECT_EQ(read_whole_file(left.place_of(s.id) / s.file), "ply\n") << s.name;
}

TEST_F(PlatformDiskTest, WhatIsScoredAlreadyIsNotTakenBack) {
  syncs_until_failure = 1;
  EXPECT_THAT(send("first"), StartsWith("HTTP/1.1 202 "));
  EXPECT_THAT(newest(), HasSubstr("running"));
  EXPECT_EQ(folders(), 1U);
}

}  // namespace
}  // namespace tankrig
