// The control channel of an emulated GigE Vision camera: datagram commands that read and write registers.
#pragma once

#include <netinet/in.h>

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "core/clock.hpp"
#include "sim_backends/wire/gige_registers.hpp"

namespace tankrig::sim {

/// Answers DISCOVERY, READREG, WRITEREG, READMEM and WRITEMEM (AIA GigE Vision 2.0, chapters 14 to 16), no other
/// command. One client controls the camera, and nobody else may write, until it releases control or misses the
/// heartbeat time-out, which also ends its pictures. A command repeated because of a late answer is executed once.
class GigeControl {
 public:
  /// A register was written. `arrival`: when the command reached this machine, however late this thread is. Called from
  /// this object's thread, before the client is answered.
  using Written = std::function<void(std::uint32_t address, std::uint32_t value, Stamp arrival)>;

  GigeControl(const std::string& address, GigeRegisters& registers, Written written);
  ~GigeControl();
  GigeControl(const GigeControl&) = delete;
  GigeControl& operator=(const GigeControl&) = delete;

  /// False: the address is none of this machine's interfaces, or its port is taken. No thread runs then.
  bool serving() const { return thread_.joinable(); }

 private:
  struct Peer {
    std::uint32_t address = 0;
    std::uint16_t port = 0;
    bool operator==(const Peer&) const = default;
  };
  using Bytes = std::vector<std::uint8_t>;

  bool open(const std::string& address);
  void run();
  void receive(int fd);
  /// Empty: no answer.
  Bytes answer(std::span<const std::uint8_t> command, const Peer& peer, Stamp arrival);
  Bytes carry_out(std::uint16_t command, std::span<const std::uint8_t> arguments, Stamp arrival, bool may_write,
                  std::uint16_t& status);
  void write_register(std::uint32_t address, std::uint32_t value, Stamp arrival);
  int until_silence() const;
  void drop_silent_controller(Stamp now);
  void update_controller(const Peer& peer, Stamp arrival);

  GigeRegisters& registers_;
  const Written written_;
  MonotonicClock clock_;
  std::vector<int> sockets_;
  int ending_ = -1;  ///< an eventfd

  // The thread's own.
  std::optional<Peer> controller_;
  Stamp heard_{};
  struct {
    Peer peer;
    std::uint16_t id = 0;
    Bytes answer;
  } last_write_;

  std::thread thread_;
};

}  // namespace tankrig::sim
