// Whole sessions for a browser: as they are, in a ZIP archive, and as a ROS bag.
#pragma once

#include <boost/asio/io_context.hpp>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "console/server/web_messages.hpp"

namespace tankrig {

class SessionDownloads {
 public:
  /// `program`: exports bags. `sessions`: their folder.
  SessionDownloads(boost::asio::io_context& io, std::string program, std::filesystem::path sessions);

  /// `path`: NAME.zip or NAME.bag. An archive is made while it is sent. A bag's index is written last, so it is made
  /// whole first, in a folder that is gone before the first byte is sent; of a session with losses it is called
  /// NAME-incomplete.bag. `moves`: the rig moves or shines: a bag has to wait.
  /// What cannot be had is said in words that the page's own frame may show.
  void get(const std::string& path, bool moves, SendReply reply);

 private:
  struct Session {
    std::string name;
    std::filesystem::path path;
  };
  WebReply zip(const Session& session);
  void bag(const Session& session, SendReply reply);

  boost::asio::io_context& io_;
  const std::string program_;
  const std::filesystem::path sessions_;
  const std::shared_ptr<int> zips_ = std::make_shared<int>(0), bags_ = std::make_shared<int>(0);  // that run
};

}  // namespace tankrig
