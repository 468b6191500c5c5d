// An upload ends when it is silent, when it takes too long, when it is too large and when the disk is full.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <functional>
#include <memory>
#include <string>

#include "console/server/web_server.hpp"
#include "core/text_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace asio = boost::asio;
using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::StartsWith;

namespace tankrig {
namespace {

/// A server and one client, in one thread.
struct UploadTest : ::testing::Test {
  UploadTest() : server(io, {.port = 0}, handlers()) {
    const std::string address = server.address();
    const std::size_t colon = address.rfind(':'), slash = address.find('/', colon);
    port = static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1, slash - colon - 1)));
    key = address.substr(address.find("key=") + 4);
  }
  ~UploadTest() override { ::close(file); }

  WebHandlers handlers() {
    WebHandlers h;
    h.get = [](const std::string&, const auto& reply) { reply({.status = 404}); };
    h.joined = h.left = [](ClientId) {};
    h.said = [](ClientId, const std::string&) {};
    h.upload = [this](const WebUpload&) {
      WebUploadPlan made = plan;
      made.file = file;
      // Whatever is captured goes with the upload.
      made.received = [this, going = std::shared_ptr<void>(nullptr, [this](void*) { over = true; })](auto reply) {
        received = true;
        if (!later) return reply({.status = 202});
        timer.expires_after(20ms);
        timer.async_wait([reply](auto) { reply({.status = 202, .body = "later"}); });
      };
      return made;
    };
    return h;
  }

  std::string head(std::size_t bytes) const {
    return "POST /api/clouds HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\nAuthorization: Bearer " + key +
           "\r\nContent-Length: " + std::to_string(bytes) + "\r\n\r\n";
  }

  /// Sends `text`, then `piece` every 10 ms if there is one, and returns what is answered until the end.
  std::string answer(const std::string& text, const std::string& piece = {}) {
    asio::ip::tcp::socket socket(io);
    socket.connect({asio::ip::make_address("127.0.0.1"), port});
    asio::write(socket, asio::buffer(text));
    asio::steady_timer next(io);
    std::function<void()> drip = [&] {
      next.expires_after(10ms);
      next.async_wait([&](auto cancelled) {
        boost::system::error_code gone;
        if (!cancelled) asio::write(socket, asio::buffer(piece), gone);
        if (!cancelled && !gone) drip();
      });
    };
    if (!piece.empty()) drip();
    std::string heard;
    asio::async_read(socket, asio::dynamic_buffer(heard), [&](auto, std::size_t) {
      next.cancel();
      io.stop();
    });
    io.restart();
    io.run_for(10s);
    return heard;
  }

  TemporaryFolder folder;
  const std::filesystem::path place = folder.path() / "upload";
  asio::io_context io;
  asio::steady_timer timer{io};
  int file = ::open(place.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0600);
  WebUploadPlan plan{.most = 1000};
  bool received = false, over = false, later = false;
  WebServer server;
  std::uint16_t port = 0;
  std::string key;
};

TEST_F(UploadTest, IsWrittenAndAnsweredOnceItIsWhole) {
  EXPECT_THAT(answer(head(11) + "hello cloud"), StartsWith("HTTP/1.1 202 "));
  EXPECT_TRUE(received);
  EXPECT_EQ(read_whole_file(place), "hello cloud");
}

TEST_F(UploadTest, MayBeAnsweredLater) {
  later = true;
  EXPECT_THAT(answer(head(3) + "abc"), HasSubstr("later"));
  EXPECT_TRUE(over);
}

TEST_F(UploadTest, EndsWhenNothingComes) {
  plan.silence = 50ms;
  const auto begin = std::chrono::steady_clock::now();
  const std::string said = answer(head(11) + "hello");
  EXPECT_GE(std::chrono::steady_clock::now() - begin, 50ms);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 8s);
  EXPECT_THAT(said, ::testing::Not(HasSubstr("202")));
  EXPECT_FALSE(received);
  EXPECT_TRUE(over) << "it is still on its way";
}

TEST_F(UploadTest, EndsWhenItTakesTooLongThoughItIsNeverSilent) {
  plan.silence = 5s;
  plan.longest = 200ms;
  const auto begin = std::chrono::steady_clock::now();
  const std::string said = answer(head(1000) + "x", "x");
  EXPECT_GE(std::chrono::steady_clock::now() - begin, 200ms);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 4s);
  EXPECT_THAT(said, ::testing::Not(HasSubstr("202")));
  EXPECT_FALSE(received);
  EXPECT_TRUE(over);
}

TEST_F(UploadTest, IsNeverSilentAndInTime) {
  plan.silence = 5s;
  EXPECT_THAT(answer(head(30), "x"), StartsWith("HTTP/1.1 202 "));
  EXPECT_EQ(read_whole_file(place), std::string(30, 'x'));
}

TEST_F(UploadTest, IsRefusedBeforeItIsReadIfItDeclaresTooMuch) {
  EXPECT_THAT(answer(head(1001)), StartsWith("HTTP/1.1 413 "));
  EXPECT_FALSE(received);
  EXPECT_EQ(std::filesystem::file_size(place), 0U);
}

TEST_F(UploadTest, SaysThatTheDiskIsFull) {
  ::close(file);
  file = ::open("/dev/full", O_WRONLY | O_CLOEXEC);
  ASSERT_GE(file, 0);
  const std::string said = answer(head(11) + "hello cloud");
  EXPECT_THAT(said, StartsWith("HTTP/1.1 507 "));
  EXPECT_THAT(said, HasSubstr("The disk is full."));
  EXPECT_FALSE(received);
  EXPECT_TRUE(over);
}

}  // namespace
}  // namespace tankrig
