// The laser on a supply relay with a serial line.
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <thread>

#include "core/clock.hpp"
#include "core/config_node.hpp"
#include "core/enum_names.hpp"
#include "core/heartbeat.hpp"
#include "core/suspend_watch.hpp"
#include "drivers/laser/laser.hpp"
#include "drivers/laser/latest_value.hpp"
#include "drivers/laser/relay_proof.hpp"
#include "drivers/laser/relay_protocol.hpp"
#include "drivers/serial/serial_port.hpp"

namespace tankrig {

enum class InterlockSight : std::uint8_t { kRead, kWired };
template <>
inline constexpr std::array kNames<InterlockSight>{"read", "wired"};

struct RelayLaserSettings {
  InterlockSight interlock = InterlockSight::kRead;  ///< whether this program sees the interlock's loop
  SerialSettings serial{.device = "", .baud = 9600};
  RelayProtocol protocol{};
  Duration warm_up = std::chrono::seconds{1};             ///< from supply to light
  Duration refresh = std::chrono::milliseconds{200};      ///< the command is sent again so often; a relay with a
                                                          ///< watchdog then opens when this program dies
  Duration query_period = std::chrono::milliseconds{50};  ///< with a status query: contacts are read so often
  Duration answer_timeout = std::chrono::milliseconds{50};
  int attempts = 3;  ///< so many failed answers in a row: the relay is not trusted, laser off
  /// On without set() or state() for longer: laser off. Shorter than the arm's watchdog, so the laser goes off first.
  Duration caller_timeout = std::chrono::milliseconds{250};
  Duration opening_timeout = std::chrono::seconds{3};
};

/// The rig file's `devices: laser:`.
extern const SettingsTable<RelayLaserSettings> kRelayKeys;

/// A `device` that begins with "runtime/" is in `runtime`.
/// Errors: InputError.
RelayLaserSettings relay_laser_settings_from(const ConfigNode& laser, const std::filesystem::path& runtime);

/// If the cycle hangs, the laser must go off before the arm is stopped.
/// Errors: InputError unless the caller_timeout of `settings`, read from `laser`, is shorter than `arm_watchdog`.
void check_goes_off_first(const ConfigNode& laser, const RelayLaserSettings& settings, Duration arm_watchdog);

/// Off when in doubt. Off is sent first on opening and after every return of the line, and last at the end. The command
/// is dropped, and must be set again, if the line hangs up, the relay does not answer or answers wrongly, the caller
/// falls silent, or the machine was suspended (which no time-out sees).
/// `powered` is the read-back contact if there is a status query, else the last echo. `since` is the time of the
/// answer: the contact moved at most answer_timeout earlier.
/// Threads: as Laser; its own thread talks to the line.
/// RT: on(), off() and state() never wait, lock or allocate.
/// Errors: state() gives kDisconnected (the line is gone), kTimeout (no answer), kProtocol (a wrong one), kSuspended
/// (until the relay has confirmed off afterwards), kInternal (its thread has ended or hangs: the refreshes end, and a
/// relay with a watchdog opens). on() is refused with the same error while it lasts. off() is always
/// accepted; state() tells when it is done.
class RelayLaser final : public Laser, public RelayProof {
 public:
  /// Waits until the relay has confirmed off. `clock`: real; it outlives this object.
  /// Errors: InputError: SerialPort's, no answer, wrong answer.
  explicit RelayLaser(const RelayLaserSettings& settings, const Clock& clock = MonotonicClock::one());
  /// Sends off, at least twice if it is not confirmed.
  ~RelayLaser() override;
  RelayLaser(const RelayLaser&) = delete;
  RelayLaser& operator=(const RelayLaser&) = delete;

  Result<LaserState> state() noexcept override;
  Duration warm_up() const noexcept override { return settings_.warm_up; }
  void last_resort() noexcept override;
  Statistics statistics() const override;
  void withhold_refreshes(bool withheld) noexcept override;
  std::optional<Duration> opened_by_itself() const noexcept override;

  /// While `veto` is set by another process, on is not sent. It outlives this.
  /// Threads: any.
  void set_veto(const std::atomic<bool>& veto) noexcept { veto_ = &veto; }

  /// The interlock's loop as last read back; nothing without a status query, or while the relay is not trusted.
  /// Threads: any.
  /// RT: safe.
  std::optional<bool> interlock_closed() const noexcept;

 private:
  Status set(bool on) noexcept override;

  enum class Request : std::uint8_t { kNone, kOff, kOn, kQuery };

  /// The device thread's knowledge, as published to the cycle.
  struct Reading {
    bool trusted = false;  ///< the relay answers
    bool powered = false;
    std::optional<bool> interlock_closed{};
    Stamp changed{};  ///< when `powered` last changed
    ErrorCode code = ErrorCode::kNotReady;
    int os_errno = 0;
  };

  Stamp now() const noexcept { return clock_.now(); }
  void run();
  void step();
  Stamp not_before(Request wanted) const noexcept;
  void wait(Stamp until) noexcept;
  void send(Request request) noexcept;
  void receive();
  bool take(std::uint8_t byte);  // false: not an answer
  void abandon() noexcept;
  void forget_abandoned(std::size_t which) noexcept;
  bool answers(Request request, std::uint8_t byte) const noexcept;
  void answered(std::uint8_t byte);
  void failed(ErrorCode code, int os_errno) noexcept;
  void distrust(ErrorCode code, int os_errno) noexcept;
  void reconnect();
  void set_powered(bool powered) noexcept;
  void publish() noexcept;
  void last_off() noexcept;
  bool withheld() const noexcept { return withheld_ && on_taken_; }
  bool forbidden() const noexcept {
    const std::atomic<bool>* const veto = veto_;
    return dying_ || (veto && *veto);
  }
  void wake() noexcept;
  void wait_until_open();

  const RelayLaserSettings settings_;
  const Clock& clock_;
  SerialPort port_;
  int wake_ = -1;  // eventfd

  // Between the threads.
  static constexpr std::uint8_t kOn = 1, kReady = 2;
  std::atomic<std::uint8_t> command_{0};
  std::atomic<bool> stop_{false}, dying_{false}, withheld_{false};
  std::atomic<std::int64_t> opened_after_ns_{0};  // in a proof; 0: not
  std::atomic<const std::atomic<bool>*> veto_{nullptr};
  enum class Loop : std::uint8_t { kUnknown, kOpen, kClosed };
  std::atomic<Loop> loop_{Loop::kUnknown};
  std::atomic<std::int64_t> last_call_ns_{0};
  LatestValue<Reading> published_;
  Heartbeat life_{Heartbeat::kUsual + settings_.answer_timeout};
  std::mutex opening_mutex_;  // guards opened_, not used by RT calls
  std::condition_variable opening_;
  bool opened_ = false;
  std::atomic<std::uint8_t> wrong_byte_{0};
  std::atomic<bool> off_echoed_{false};

  struct Counts {
    std::atomic<std::uint64_t> commands{0}, echoes_missing{0}, wrong_echoes{0}, late_answers{0}, refreshes{0},
        queries{0}, disconnects{0}, reconnects{0}, latched_off{0}, caller_timeouts{0};
    std::atomic<std::int64_t> slowest_answer_ns{0};
  } counts_;

  // The device thread's own.
  Reading reading_;
  Request waiting_for_ = Request::kNone;
  std::array<Request, 4> abandoned_{};  // overtaken or timed out: their answers may still come, oldest first
  std::size_t abandoned_count_ = 0;
  Request confirmed_ = Request::kNone;  // kOn or kOff
  Stamp sent_{}, deadline_{}, refresh_at_{}, query_at_{}, quiet_until_{}, late_until_{};
  int failures_ = 0;
  bool lost_ = false, on_taken_ = false;
  Stamp last_on_{};
  SuspendWatch suspend_watch_;

  std::thread thread_;  // last: it uses all of the above
};

}  // namespace tankrig
