// One question, one answer: the serial conversation both lux meters share.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/clock.hpp"
#include "core/result.hpp"
#include "drivers/serial/serial_port.hpp"
#include "drivers/statistics.hpp"

namespace tankrig {

/// Asks until an answer decodes or the time is over. Bytes that belong to no answer are skipped one by one. A lost line
/// is reopened as soon as it is back.
/// Threads: one.
/// RT: never.
class LuxLine {
 public:
  /// `no_answer` and `no_sense` say what to do: string literals for Error::where.
  LuxLine(const SerialSettings& serial, Duration reply_timeout, const char* no_answer, const char* no_sense);

  /// Answers have `length` bytes and begin with `prefix`; `decode` turns them into a Result<T>. `last` is the overall
  /// deadline.
  /// Errors: kTimeout, kProtocol (bytes came, none made sense), kDisconnected.
  template <class Decode>
  auto ask(std::span<const std::uint8_t> request, std::span<const std::uint8_t> prefix, std::size_t length,
           Decode decode, Stamp last) -> decltype(decode(request)) {
    heard_ = false;
    for (bool again = false;; again = true) {
      if (Status begun = begin(request, again, last); !begun.ok()) return begun.error();
      for (;;) {
        while (find(prefix, length)) {
          auto answer = decode(std::span<const std::uint8_t>(bytes_.data(), length));
          if (answer.ok()) {
            take(length);
            return answer;
          }
          ++wrong_replies_;
          skip();
        }
        if (!receive()) break;
      }
      if (clock_.now() >= last) return failure();
    }
  }

  /// When the last answered request was sent.
  Stamp asked() const noexcept { return asked_; }
  Statistics statistics() const;

 private:
  Status begin(std::span<const std::uint8_t> request, bool again, Stamp last);
  bool find(std::span<const std::uint8_t> prefix, std::size_t length);
  bool receive();
  void skip();
  void take(std::size_t length);
  Error failure() const noexcept;

  MonotonicClock clock_;
  SerialPort port_;
  const Duration reply_timeout_;
  const char* const no_answer_;
  const char* const no_sense_;
  std::array<std::uint8_t, 256> bytes_{};
  std::size_t count_ = 0;
  Stamp asked_{}, deadline_{};
  bool heard_ = false;  // anything, since the first question
  std::uint64_t requests_ = 0, replies_ = 0, retries_ = 0, timeouts_ = 0, wrong_replies_ = 0, skipped_bytes_ = 0,
                disconnects_ = 0, reconnects_ = 0;
};

}  // namespace tankrig
