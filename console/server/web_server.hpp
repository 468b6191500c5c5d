// What browsers and programs are answered: who asks, how often, and what the asker may do.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "console/server/connections.hpp"
#include "console/server/rate_limits.hpp"

namespace tankrig {

/// A POST whose body has not been read.
struct WebUpload {
  std::string path;                          ///< decoded, without the query
  std::map<std::string, std::string> query;  ///< decoded
  std::string user, address;                 ///< who sends it
  std::optional<std::uint64_t> bytes;        ///< as it declares
};

/// Called in the thread of the io_context.
struct WebHandlers {
  /// `path`: decoded, without the query.
  std::function<void(const std::string& path, SendReply reply)> get;
  std::function<void(ClientId)> joined, left;
  std::function<void(ClientId, const std::string& text)> said;
  std::function<WebUploadPlan(const WebUpload&)> upload = {};  ///< none: nothing can be sent
};

class WebServer {
 public:
  /// Errors: InputError as Connections has them, and if the users' file cannot be used.
  WebServer(boost::asio::io_context& io, const ListenOptions& options, WebHandlers handlers);
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  /// For a browser; with the key, if that lets in.
  std::string address() const { return access_.address(); }
  /// To whom messages are sent, and what each may do.
  Connections& clients() { return connections_; }

 private:
  WebAnswer answer(const WebRequest& request);
  /// Where there are users: what they meet before they are let in, and how they leave.
  std::optional<WebAnswer> answer_of_login(const WebRequest& request, const std::string& path,
                                           const std::shared_ptr<BrowserSession>& session);
  AskForReply get(const std::string& path);
  WebUploadPlan upload(const WebRequest& request, const std::string& path, const BrowserSession& session);
  WebAnswer log_in(const std::string& address);
  void check(const std::string& name, const std::string& password, const std::string& address, SendReply reply);
  /// Its WebSockets end with it, and so does what moves or shines by its wish.
  WebReply log_out(const std::shared_ptr<BrowserSession>& session);

  boost::asio::io_context& io_;
  const std::filesystem::path users_;
  const WebHandlers handlers_;
  Connections connections_;
  Access access_;
  RequestLimit requests_;
  LoginDelay delay_;
  int checks_ = 0;  // of passwords, that run
};

}  // namespace tankrig
