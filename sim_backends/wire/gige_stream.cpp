#include "sim_backends/wire/gige_stream.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>

namespace tankrig::sim {
namespace {

using namespace gige_register;

constexpr std::uint8_t kLeader = 1, kTrailer = 2, kPayload = 3;
constexpr std::uint32_t kImage = 1;
constexpr std::size_t kHeaders = 20 + 8 + 8;  // of IP, UDP and the stream: the packet size counts them
constexpr std::uint32_t kSizeMask = 0xFFFF;
constexpr std::size_t kLeastSize = 576;  // what every host takes (RFC 791)

}  // namespace

GigeStream::GigeStream(const std::string& address, const GigeRegisters& registers, const std::atomic<double>& loss)
    : registers_(registers), loss_(loss), fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in own{};
  own.sin_family = AF_INET;
  ::inet_pton(AF_INET, address.c_str(), &own.sin_addr);
  ready_ = fd_ >= 0 && ::bind(fd_, reinterpret_cast<const sockaddr*>(&own), sizeof own) == 0;
}

GigeStream::~GigeStream() {
  if (fd_ >= 0) ::close(fd_);
}

void GigeStream::send(const GigeFrame& frame) {
  begin(frame.id, kLeader, 0);
  put32(kImage);
  put32(static_cast<std::uint32_t>(frame.timestamp >> 32));
  put32(static_cast<std::uint32_t>(frame.timestamp));
  put32(frame.pixel_format);
  for (const int pixels : {frame.size.width, frame.size.height, frame.offset.x, frame.offset.y})
    put32(static_cast<std::uint32_t>(pixels));
  put32(0);  // padding
  send_packet();

  const std::size_t size = registers_.get(kStreamPacketSize) & kSizeMask;
  const std::size_t most = std::max(size, kLeastSize) - kHeaders;
  std::uint32_t number = 1;
  for (std::size_t at = 0; at < frame.data.size(); at += most, ++number) {
    begin(frame.id, kPayload, number);
    const auto part = frame.data.subspan(at, std::min(most, frame.data.size() - at));
    packet_.insert(packet_.end(), part.begin(), part.end());
    send_packet();
  }

  begin(frame.id, kTrailer, number);
  put32(kImage);
  put32(static_cast<std::uint32_t>(frame.size.height));
  send_packet();
}

void GigeStream::begin(std::uint16_t id, std::uint8_t content, std::uint32_t number) {
  packet_.clear();
  put16(0);  // status
  put16(id);
  put32(static_cast<std::uint32_t>(content) << 24 | number);
}

void GigeStream::put16(std::uint32_t value) {
  packet_.push_back(static_cast<std::uint8_t>(value >> 8));
  packet_.push_back(static_cast<std::uint8_t>(value));
}

void GigeStream::put32(std::uint32_t value) {
  put16(value >> 16);
  put16(value);
}

/// A packet that the network does not take is lost, as one of a camera.
void GigeStream::send_packet() {
  if (std::uniform_real_distribution<>()(random_) < loss_) return;
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(registers_.get(kStreamPort)));
  to.sin_addr.s_addr = htonl(registers_.get(kStreamAddress));
  ::sendto(fd_, packet_.data(), packet_.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
}

}  // namespace tankrig::sim
