// Carries the joint slots between host and arm: CAN frames or the 51-byte serial frame.
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

/// The arm's answer to one request.
struct ArmAnswer {
  Stamp read{};          ///< when the encoders were read
  bool sensors = false;  ///< else an echo or an acknowledgement
  ArmExchange has{};     ///< what came with it; the rest of what follows is older
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

/// One request is on its way at a time; only a stop may overtake. An answer belongs to the oldest outstanding request.
/// Threads: one at a time, except where said.
/// RT: all but reopen().
class ArmLink {
 public:
  virtual ~ArmLink() = default;

  /// Sends the demands that `exchange` names, whole or not at all as far as the carrier can, and asks for the slots it
  /// names. A carrier without partial exchanges exchanges everything.
  /// Errors: kRefused when its buffer is full (normal, counted), kDisconnected.
  virtual Status try_send(const ArmDemands& demands, const ArmExchange& exchange, Stamp now) noexcept = 0;
  virtual Status try_send(const PidSlot& gains, Stamp now) noexcept = 0;

  /// Writes whole demands to the wire, whatever its state and whatever another thread is doing with it. They may land
  /// inside that thread's request: sent once more, they are understood.
  /// Threads: any. Async-signal-safe.
  virtual void send_regardless(const ArmDemands& demands) const noexcept = 0;

  /// Next whole answer; nothing if none has come.
  /// Errors: kDisconnected and what the carrier says.
  virtual Result<std::optional<ArmAnswer>> try_receive(Stamp now) noexcept = 0;

  /// Whether a frame sent now would leave.
  /// Errors: kNotReady (bus-off).
  virtual Status sends() const noexcept { return {}; }
  /// Requests sent, unanswered and not forgotten.
  virtual int outstanding() const noexcept = 0;
  /// Forgets outstanding requests, and drops any part of an answer.
  virtual void forget() noexcept = 0;

  /// After kDisconnected, from a thread that may wait.
  /// Errors: kNotReady while the device is away.
  virtual Status reopen() noexcept = 0;
  /// The line stays lost until reopen().
  virtual bool needs_reopen() const noexcept = 0;

  /// Wire time of a whole request and its answer.
  virtual Duration exchange_time() const noexcept = 0;
  virtual ArmLinkCounters counters() const noexcept = 0;
  /// Counters of the layer below, if any.
  /// Threads: any.
  virtual Statistics carrier_statistics() const { return {}; }
};

}  // namespace tankrig
