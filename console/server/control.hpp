// Who may start and steer: one browser at a time. Stopping needs no control.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace tankrig {

using ClientId = std::uint64_t;

class Control {
 public:
  /// True if `client` holds it from now on: nobody did, or the holder has asked to give it away.
  bool take(ClientId client) {
    if (holder_ && *holder_ != client && !offered_) return false;
    holder_ = client;
    offered_ = false;
    return true;
  }
  /// The holder lets the next one have it.
  void offer(ClientId client) { offered_ = offered_ || holds(client); }
  /// Given up, or the connection is lost: true if it was the holder.
  bool lose(ClientId client) {
    if (!holds(client)) return false;
    holder_.reset();
    offered_ = false;
    return true;
  }
  bool holds(ClientId client) const { return holder_ == client; }
  const std::optional<ClientId>& holder() const { return holder_; }
  bool offered() const { return offered_; }

 private:
  std::optional<ClientId> holder_;
  bool offered_ = false;
};

}  // namespace tankrig
