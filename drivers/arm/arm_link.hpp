// What carries the joint slots between host and arm: CAN frames or the 51-byte serial frame.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/arm_model.hpp"
#include "core/result.hpp"
#include "drivers/arm/arm_exchange.hpp"
#include "drivers/arm/joint_slot.hpp"
#include "drivers/statistics.hpp"

namespace tankrig {

using ArmDemands = std::array<DemandSlot, kJoints>;  ///< in the order of `Joint`

/// What the arm answered to one request.
struct ArmAnswer {
  Stamp read{};          ///< when the encoders were read
  bool sensors = false;  ///< else an echo or an acknowledgement
  ArmExchange has{};     ///< what has come with it; the rest of what follows is older
  std::array<SensorSlot, kJoints> joints{};
  MasterBytes master;
};

struct ArmLinkCounters {
  std::uint64_t answers = 0;
  std::uint64_t checksum_errors = 0, length_errors = 0, discarded_bytes = 0, resyncs = 0;  ///< serial
  std::uint64_t wrong_ids = 0, wrong_lengths = 0, incomplete = 0;                          ///< CAN
  std::uint64_t unknown_slots = 0;  ///< a kind of slot the arm never sends
  std::uint64_t send_buffer_full = 0;
  std::uint64_t reopened = 0;
};

/// One request is on its way at a time; a stop may overtake. An answer is to the oldest that is outstanding.
/// Threads: one at a time, except where said.
/// RT: all but reopen().
class ArmLink {
 public:
  virtual ~ArmLink() = default;

  /// Sends those demands that `exchange` names, whole or not at all as far as the carrier can, and asks for what it
  /// names. A carrier that cannot do less exchanges everything.
  /// Errors: kRefused when its buffer is full (ordinary, counted), kDisconnected.
  virtual Status try_send(const ArmDemands& demands, const ArmExchange& exchange, Stamp now) noexcept = 0;
  virtual Status try_send(const PidSlot& gains, Stamp now) noexcept = 0;

  /// Puts whole demands on the wire, whatever state it is in and another thread is doing with it. They may fall into
  /// the middle of that one's request: once more, and they are understood.
  /// Threads: any. Async-signal-safe.
  virtual void send_regardless(const ArmDemands& demands) const noexcept = 0;

  /// Next whole answer that has come; nothing if none.
  /// Errors: kDisconnected and what the carrier says.
  virtual Result<std::optional<ArmAnswer>> try_receive(Stamp now) noexcept = 0;

  /// Would what is sent now come out? Errors: kNotReady (bus-off).
  virtual Status sends() const noexcept { return {}; }
  /// Requests sent, not answered and not forgotten.
  virtual int outstanding() const noexcept = 0;
  /// Nothing will come of them any more; drops any part of an answer.
  virtual void forget() noexcept = 0;

  /// After kDisconnected, from a thread that may wait.
  /// Errors: kNotReady while the device is away.
  virtual Status reopen() noexcept = 0;
  /// It does not come back without reopen().
  virtual bool needs_reopen() const noexcept = 0;

  /// Wire time of a whole request and its answer.
  virtual Duration exchange_time() const noexcept = 0;
  virtual ArmLinkCounters counters() const noexcept = 0;
  /// Of what lies below, if it counts.
  /// Threads: any.
  virtual Statistics carrier_statistics() const { return {}; }
};

}  // namespace tankrig
