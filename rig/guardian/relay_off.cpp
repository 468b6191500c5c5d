#include "rig/guardian/relay_off.hpp"

#include <array>

namespace tankrig {

void RelayOff::ask() noexcept {
  if (port_.descriptor() < 0 && !port_.reopen().ok()) {
    restart();
    return;
  }
  const std::array<std::uint8_t, 2> bytes{protocol_.off_byte, protocol_.status_query.value_or(0)};
  (void)port_.try_write(std::span(bytes).first(echoed_ && protocol_.status_query ? 2 : 1));
}

void RelayOff::listen() noexcept {
  std::array<std::uint8_t, 64> bytes;
  const auto got = port_.try_read(bytes);
  if (!got.ok()) {
    restart();
    return;
  }
  for (const std::uint8_t byte : std::span(bytes).first(got.value())) {
    if (byte == protocol_.off_byte) {
      echoed_ = true;
      if (!protocol_.status_query) dark_ = true;
    } else if (const auto status = decode_relay_status(byte); status && protocol_.status_query && echoed_) {
      dark_ = !status->closed;
    }
  }
}

}  // namespace tankrig
