// Switches the laser's relay off, again and again, and hears whether it did.
#pragma once

#include "drivers/laser/relay_protocol.hpp"
#include "drivers/serial/serial_port.hpp"

namespace tankrig {

/// Sends nothing but off and, once that is echoed, the status query.
/// Threads: one.
/// RT: all but construction; a lost line is opened again, which may take its time.
class RelayOff {
 public:
  RelayOff(const SerialSettings& line, const RelayProtocol& protocol) : port_(line, -1), protocol_(protocol) {}

  /// The line as the program has opened it.
  void take(int line) noexcept {
    port_.take(line);
    restart();
  }
  /// Forgets what the relay has said so far.
  void restart() noexcept { echoed_ = dark_ = false; }
  void ask() noexcept;
  void listen() noexcept;
  /// Off is echoed and, with a status query, the contact reads open since.
  bool dark() const noexcept { return dark_; }
  /// At the last ask() there was no line.
  bool lost() const noexcept { return port_.descriptor() < 0; }

 private:
  SerialPort port_;
  const RelayProtocol protocol_;
  bool echoed_ = false, dark_ = false;
};

}  // namespace tankrig
