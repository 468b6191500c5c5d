// What a browser asks and what it gets, whatever carries it.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "console/server/access.hpp"

namespace tankrig {

/// Its body has not been read. Its texts live until it is answered.
struct WebRequest {
  enum class Method { kGet, kPost, kOther } method = Method::kGet;
  std::string_view target;  ///< as it came: path and query
  RequestHeaders headers;
  std::string_view address;            ///< who asks: an address, or a network of IPv6 that one machine may use all of
  std::optional<std::uint64_t> bytes;  ///< of its body, as it declares
};

struct WebReply {
  unsigned status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body = {};
  int file = -1;                           ///< an open regular file instead of a body; closed by the server
  std::string policy = {};                 ///< Content-Security-Policy; empty: the console's own
  std::string download_as = {};            ///< a plain file name; empty: shown
  std::string location = {}, cookie = {};  ///< of their headers; empty: none
  int retry_after_s = 0;                   ///< 0: not said
  /// Instead of a body: called for piece after piece, until one is empty. What it throws, or another sum than `bytes`,
  /// breaks the connection, so that nobody takes a part for the whole.
  std::function<std::string()> pieces = {};
  std::uint64_t bytes = 0;  ///< of all pieces
};

using SendReply = std::function<void(WebReply)>;     ///< may be called later, once
using AskForReply = std::function<void(SendReply)>;  ///< called once

/// A small body is read first.
struct WebForm {
  std::size_t most = 0;                                                      ///< bytes
  std::function<void(std::optional<std::string> body, SendReply)> received;  ///< nothing: it did not arrive whole
};

/// A large body is written to a file.
struct WebUploadPlan {
  WebReply refusal = {};   ///< sent at once, with the body unread, if there is no `received`
  int file = -1;           ///< where the body is written to; stays open and is closed by whoever `received` belongs to
  std::uint64_t most = 0;  ///< bytes; beyond them 413
  std::chrono::milliseconds silence = std::chrono::seconds{20}, longest = std::chrono::minutes{15};  ///< end it
  /// Called when all is there; destroyed without a call if it never is.
  AskForReply received = {};
};

/// The request becomes a WebSocket, as long as the session lasts.
struct WebTalk {
  std::shared_ptr<BrowserSession> session;
};

using WebAnswer = std::variant<WebReply, AskForReply, WebForm, WebUploadPlan, WebTalk>;

}  // namespace tankrig
