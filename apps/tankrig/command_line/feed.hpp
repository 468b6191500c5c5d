// What a command tells the program that shows it, while it runs (console/feed/feed_format.hpp).
#pragma once

#include <atomic>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/time.hpp"
#include "reconstruction/cloud/cloud.hpp"

namespace tankrig::app {

/// Never waits: what a listener has no room for is lost, pictures and points first, what is said once last. One that has
/// gone is not told again. Does nothing where nobody listens.
/// Threads: any.
class Feed {
 public:
  /// The first call reads the environment and takes the descriptor out of it: no other program inherits it.
  static Feed& one();

  bool heard() const noexcept { return socket_.load(std::memory_order_relaxed) >= 0; }
  void tell(const nlohmann::ordered_json& message) noexcept;
  /// What is soon told anew.
  void tell_newest(const nlohmann::ordered_json& message) noexcept;
  /// The page that a command has left; a path from the working directory.
  void report(const std::filesystem::path& file);
  /// `frame`: the stamp of the one they are from. Frame: b.
  void points(Stamp frame, const std::vector<CloudPoint>& points) noexcept;
  /// 8 bits, grey or BGR.
  void picture(const std::string& camera, const cv::Mat& picture) noexcept;

 private:
  Feed() noexcept;
  /// `room`: share of the socket's buffer that may then be in use.
  void send(const std::string& message, double room) noexcept;

  std::atomic<int> socket_{-1};
  int buffer_ = 0;  ///< the socket's [bytes]
};

}  // namespace tankrig::app
