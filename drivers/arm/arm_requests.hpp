// Requests to the arm and their answers: when the next request is due and what it says, which answers count, when a
// request is given up, and when the arm is silent or its carrier lost.
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <optional>

#include "drivers/arm/arm5e_settings.hpp"
#include "drivers/arm/arm_counts.hpp"

namespace tankrig {

/// Demands of rest, with the settings' limits.
ArmDemands rest_demands(const Arm5eSettings& settings) noexcept;
/// Alters the demands where that means nothing: an arm that went mute answers again when its request changes.
inline void alter(ArmDemands& demands) noexcept { demands[kJawRotate].speed_limit ^= 1U; }

/// The encoders were read some time between a request and its answer, and an answer does not say which request it
/// belongs to. So only a stop is sent while an answer may still come. An answer is counted and discarded if it is late
/// or unasked, or the first one after a late or a missing one.
/// Threads: one at a time, except where said.
/// RT: all but reopen() and carrier_statistics().
class ArmRequests {
 public:
  /// An answer with readings that count.
  struct News {
    ArmAnswer answer;
    bool powered_up = false;  ///< after a silence every encoder reads as at power-up, which they did not before
  };

  /// `settings` and `counts` outlive it.
  ArmRequests(const Arm5eSettings& settings, std::unique_ptr<ArmLink> link, Stamp now, ArmCounts& counts);

  /// Velocity of each joint [ticks/s]; sent with the next due request.
  void demand(const std::array<double, kJoints>& ticks_per_s) noexcept;
  /// Whether a demand is other than rest.
  /// Threads: any.
  bool driven() const noexcept { return driven_; }
  Duration period() const noexcept { return period_; }

  /// Sends what is due: the gains first, then the newest demands, at the exchange rate.
  /// Errors: "arm: ...".
  Status send_due(Stamp now) noexcept { return send(now, false); }
  /// If rest is demanded: sends at once, unless every joint's newest demand on the wire is rest.
  Status send_rest(Stamp now) noexcept { return send(now, !stop_sent_); }
  /// Sends rest past the thread inside, which may be dead or hang. Every other one is altered, for an arm that went
  /// mute.
  /// Threads: any. Async-signal-safe.
  void send_rest_regardless() const noexcept {
    link_->send_regardless(past_sent_.fetch_xor(1) == 0 ? rest_ : altered_rest_);
  }
  /// The same, and nothing else is sent from here on.
  /// Threads: any. Async-signal-safe.
  void last_resort() noexcept {
    dying_ = true;
    send_rest_regardless();
  }

  /// While `veto` is set by another process, nothing but rest is sent. It outlives this.
  /// Threads: any.
  void set_veto(const std::atomic<bool>& veto) noexcept { veto_ = &veto; }

  /// Somebody listens: after a long pause, silence counts from here.
  void listen(Stamp now) noexcept;
  /// The next answer that counts; nothing if none has come.
  /// Errors: the carrier's, once it is lost.
  Result<std::optional<News>> receive(Stamp now) noexcept;
  /// Whether any joint, or the arm itself, has been silent for too long. Then the next request is whole, and the gains
  /// are sent again.
  bool silent(Stamp now) noexcept;
  /// The arm may have lost its supply: sends its gains again.
  void send_gains_again() noexcept;

  bool connected() const noexcept { return connected_; }
  /// The line stays lost until reopen().
  /// Threads: any.
  bool line_lost() const noexcept { return line_lost_; }
  Status reopen() noexcept { return link_->reopen(); }
  void line_is_back() noexcept { line_lost_ = false; }

  ArmLinkCounters link_counters() const noexcept { return link_->counters(); }
  /// Threads: any.
  Statistics carrier_statistics() const { return link_->carrier_statistics(); }

 private:
  bool too_long(Stamp now) const noexcept { return now - heard_.oldest() > settings_.silence_timeout; }
  Duration answer_time() const noexcept { return link_->exchange_time() + settings_.reply_timeout; }
  bool is_late(const ArmAnswer& answer, bool asked) noexcept;
  std::optional<News> take(const ArmAnswer& answer, bool asked, Stamp now) noexcept;
  void lose() noexcept;
  void repeat(Stamp now) noexcept;
  Status send(Stamp now, bool at_once) noexcept;
  Status send_demands(const ArmExchange& exchange, Stamp now) noexcept;
  bool forbidden() const noexcept {
    const std::atomic<bool>* const veto = veto_;
    return dying_ || (veto && *veto);
  }

  const Arm5eSettings& settings_;
  ArmCounts& counts_;
  const Duration period_;
  const ArmDemands rest_, altered_rest_;
  mutable std::atomic<std::uint8_t> past_sent_{0};
  std::unique_ptr<ArmLink> link_;
  ArmDemands demands_{};
  ExchangeSchedule schedule_;
  LastHeard heard_;
  ArmAnswer last_;
  bool changed_in_round_ = true;
  bool gains_next_ = true, gains_answered_ = false, gains_last_ = false;
  bool wobble_ = false;     ///< which of two equivalent frames is sent
  bool stop_sent_ = false;  ///< every joint's newest demand on the wire is rest
  bool in_time_ = false;    ///< the newest answer was
  int stop_awaits_ = 0;     ///< answers up to the one to a stop
  bool connected_ = true, was_silent_ = false;
  Stamp next_send_{}, sent_at_{}, listened_{};
  Stamp asked_at_{};  ///< the oldest unanswered request, or an older one
  std::atomic<bool> driven_{false}, line_lost_{false}, dying_{false};
  std::atomic<const std::atomic<bool>*> veto_{nullptr};
};

}  // namespace tankrig
