#include "apps/tankrig/command_line/feed.hpp"

#include <fcntl.h>
#include <linux/sockios.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "console/feed/feed_format.hpp"
#include "core/picture_codecs.hpp"

namespace tankrig::app {
namespace {

constexpr double kOfPictures = 0.5, kOfNewest = 0.75, kOfOnce = 1;  // room, by what is sent
constexpr int kBuffer = 208 << 10;  // [bytes] asked for: what any Linux gives; it takes twice as much
constexpr int kWidest = 960;        // of a picture [px]
constexpr int kQuality = 80;        // of its JPEG
constexpr std::size_t kMostPoints = (kMostFeedBytes - kPointsBegin) / (3 * sizeof(float));

/// -1 unless the variable names a socket of the right kind.
int inherited_socket() noexcept {
  const char* const name = std::getenv(kFeedVariable);
  if (!name) return -1;
  int descriptor = -1, type = 0;
  const char* const end = name + std::strlen(name);
  const bool number = std::from_chars(name, end, descriptor).ptr == end;
  ::unsetenv(kFeedVariable);
  socklen_t size = sizeof type;
  if (!number || ::getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_SEQPACKET) return -1;
  ::fcntl(descriptor, F_SETFD, FD_CLOEXEC);
  return descriptor;
}

std::string begin(FeedKind kind) { return std::string(1, static_cast<char>(kind)); }

std::string text_message(const nlohmann::ordered_json& message) {
  return begin(FeedKind::kText) + message.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

Feed& Feed::one() {
  static Feed feed;
  return feed;
}

Feed::Feed() noexcept : socket_(inherited_socket()) {
  ::setsockopt(socket_, SOL_SOCKET, SO_SNDBUF, &kBuffer, sizeof kBuffer);
  socklen_t size = sizeof buffer_;
  ::getsockopt(socket_, SOL_SOCKET, SO_SNDBUF, &buffer_, &size);
}

void Feed::send(const std::string& message, double room) noexcept {
  const int socket = socket_.load(std::memory_order_relaxed);
  int waiting = 0;
  ::ioctl(socket, SIOCOUTQ, &waiting);
  if (message.size() > kMostFeedBytes || waiting + static_cast<double>(message.size()) > room * buffer_) return;
  if (::send(socket, message.data(), message.size(), MSG_DONTWAIT | MSG_NOSIGNAL) >= 0) return;
  if (errno == EPIPE || errno == ECONNRESET || errno == EBADF) socket_ = -1;
}

void Feed::tell(const nlohmann::ordered_json& message) noexcept {
  if (heard()) send(text_message(message), kOfOnce);
}

void Feed::tell_newest(const nlohmann::ordered_json& message) noexcept {
  if (heard()) send(text_message(message), kOfNewest);
}

void Feed::report(const std::filesystem::path& file) { tell({{"feed", "report"}, {"file", file.string()}}); }

void Feed::points(Stamp frame, const std::vector<CloudPoint>& points) noexcept {
  if (!heard()) return;
  for (std::size_t from = 0; from < points.size(); from += kMostPoints) {
    std::string message = begin(FeedKind::kPoints);
    message.append(reinterpret_cast<const char*>(&frame.ns), sizeof frame.ns);
    for (std::size_t i = from; i < std::min(points.size(), from + kMostPoints); ++i) {
      const Eigen::Vector3f p = points[i].p.cast<float>();
      message.append(reinterpret_cast<const char*>(p.data()), 3 * sizeof(float));
    }
    send(message, kOfPictures);
  }
}

void Feed::picture(const std::string& camera, const cv::Mat& picture) noexcept {
  if (!heard() || picture.empty()) return;
  try {
    cv::Mat shown = picture;
    if (const int width = picture.cols; width > kWidest)
      cv::resize(picture, shown, {kWidest, picture.rows * kWidest / width}, 0, 0, cv::INTER_AREA);
    const std::string name = camera.substr(0, 255);
    std::string message = begin(FeedKind::kPicture);
    message += static_cast<char>(name.size());
    message += name;
    message += picture_jpeg(shown, kQuality);
    send(message, kOfPictures);
  } catch (const std::exception&) {  // a picture that nobody sees; the frame itself is recorded elsewhere
  }
}

}  // namespace tankrig::app
