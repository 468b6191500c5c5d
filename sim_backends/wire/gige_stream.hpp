// The stream channel of an emulated GigE Vision camera: frames in datagrams.
#pragma once

#include <atomic>
#include <cstdint>
#include <opencv2/core.hpp>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "sim_backends/wire/gige_registers.hpp"

namespace tankrig::sim {

struct GigeFrame {
  std::uint16_t id = 1;
  std::uint64_t timestamp = 0;  ///< device ticks
  std::uint32_t pixel_format = 0;
  cv::Size size;
  cv::Point offset;
  std::span<const std::uint8_t> data;
};

/// Leader, payload and trailer of an image with 16-bit block numbers (AIA GVSP 2.0), in packets of the client's size,
/// to the client's address and port.
/// Threads: send() in one.
class GigeStream {
 public:
  /// `loss`: share of packets that get lost; drawn anew for each packet, the same in every run.
  GigeStream(const std::string& address, const GigeRegisters& registers, const std::atomic<double>& loss);
  ~GigeStream();
  GigeStream(const GigeStream&) = delete;
  GigeStream& operator=(const GigeStream&) = delete;

  /// False: there is no socket at the address.
  bool ready() const { return ready_; }
  void send(const GigeFrame& frame);

 private:
  void begin(std::uint16_t id, std::uint8_t content, std::uint32_t number);
  void put16(std::uint32_t value);
  void put32(std::uint32_t value);
  void send_packet();

  const GigeRegisters& registers_;
  const std::atomic<double>& loss_;
  int fd_;
  bool ready_ = false;
  std::minstd_rand random_;
  std::vector<std::uint8_t> packet_;
};

}  // namespace tankrig::sim
