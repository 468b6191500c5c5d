// A CAN bus that spans processes: nodes connect to a local socket and hear each other at the pace of a real wire.
#pragma once

#include <linux/can.h>
#include <sys/types.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "core/time.hpp"

namespace tankrig::sim {

struct CanHubSettings {
  std::filesystem::path path;         ///< of the socket; drivers open "unix:PATH"
  int bitrate = 500'000;              ///< [bit/s]
  int send_queue_frames = 16;         ///< capacity of a node's controller; its socket holds the rest
  int receive_queue_bytes = 1 << 20;  ///< capacity for a node that does not read; then its frames are lost
};

struct CanNodeReport {
  int number = 0;     ///< by order of connection, from 0
  pid_t process = 0;  ///< that connected
  bool listens_only = false;
  std::uint64_t sent = 0, delivered = 0, overflowed = 0;
};

struct CanHubReport {
  std::uint64_t frames = 0, discarded = 0, malformed = 0;
  Duration busy{};  ///< time the wire was in use
  std::vector<CanNodeReport> nodes;
};

/// Datagrams of one `struct can_frame` each, SOCK_SEQPACKET. Every data or remote frame takes its exact time on the
/// wire (drivers/can/can_timing.hpp) and then reaches all other nodes, in order; of waiting frames the lowest
/// identifier goes first. If no other node acknowledges a frame, it waits, its sender is told once (no-ack,
/// error-passive), and its queue fills up, as on a real bus. Error frames pass at once and take no time. A node that
/// shuts down its sending half only listens and does not acknowledge. Keeps CLOCK_MONOTONIC.
/// Threads: a thread of its own serves the nodes; all members may be called from any.
/// RT: never.
class CanHub {
 public:
  static constexpr int kEveryone = -1;

  /// Replaces a stale socket that nobody serves.
  /// Errors: InputError: path too long, missing folder, bus already served.
  explicit CanHub(const CanHubSettings& settings);
  ~CanHub();
  CanHub(const CanHub&) = delete;
  CanHub& operator=(const CanHub&) = delete;

  /// Hands `frame`, usually an error frame, to a node (or everyone) at once.
  void inject(const can_frame& frame, int node = kEveryone);
  /// Takes the node off the bus as its controller would. It is told, hears and sends nothing, and is told again when it
  /// is back: `restart` later (restart-ms of a real interface) or never.
  void bus_off(int node, std::optional<Duration> restart);

  /// Holds the bus dominant: nothing passes and every queue fills up.
  void jam(bool jammed);
  /// Cuts or mends the node's cable: nobody hears it, it hears nobody, and nobody acknowledges.
  void cut(int node, bool severed);

  CanHubReport report() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tankrig::sim
