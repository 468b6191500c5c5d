// An emulated serial device: a pseudo-terminal, a listening thread, and answers that may be delayed.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "core/time.hpp"
#include "sim_backends/wire/pty.hpp"

namespace tankrig::sim {

/// Threads: the callbacks run in the server's own; only they may call answer(); the rest from any.
class PtyServer {
 public:
  using Receive = std::function<void(std::span<const std::uint8_t>)>;
  /// Called in every round; returns how long it may sleep at most.
  using Tick = std::function<Duration()>;

  /// Errors: InputError, as Pty.
  PtyServer(std::filesystem::path name, Receive receive, Tick tick);
  ~PtyServer();
  PtyServer(const PtyServer&) = delete;
  PtyServer& operator=(const PtyServer&) = delete;

  /// Sent after `delay`, in order.
  void answer(std::span<const std::uint8_t> bytes, Duration delay = Duration{0});
  /// Unplugs, or plugs in again; done on return.
  void unplug() { set_plugged(false); }
  void plug() { set_plugged(true); }
  /// A round begins now.
  void wake() noexcept;
  const std::filesystem::path& name() const noexcept { return pty_.name(); }

 private:
  struct Answer {
    Stamp due;
    std::vector<std::uint8_t> bytes;
  };

  void run();
  void set_plugged(bool plugged);
  void follow_plug();
  Duration send_due();

  Receive receive_;
  Tick tick_;
  Pty pty_;
  std::deque<Answer> answers_;
  int wake_ = -1;     // eventfd
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  bool stop_ = false, wanted_plugged_ = true, plugged_ = true;
  std::thread thread_;
};

}  // namespace tankrig::sim
