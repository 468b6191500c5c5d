// Whose requests and connections are counted together.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <string>

namespace tankrig {

/// One address, or a network of IPv6 (/64) that one machine may use all of. No text for people.
inline std::string counted_address(const boost::asio::ip::address& address) {
  if (!address.is_v6()) return address.to_string();
  const auto bytes = address.to_v6().to_bytes();
  return {bytes.begin(), bytes.begin() + 8};
}

}  // namespace tankrig
