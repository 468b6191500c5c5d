#include "sim_backends/wire/emulated_hand.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include "core/input_error.hpp"

namespace tankrig::sim {
namespace {

constexpr int kLook_ms = 50;

/// Nothing for a path that is too long for a socket.
std::optional<sockaddr_un> address_of(const std::filesystem::path& socket) noexcept {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string& name = socket.native();
  if (name.size() >= sizeof address.sun_path) return {};
  std::memcpy(address.sun_path, name.c_str(), name.size() + 1);
  return address;
}

OwnedDescriptor new_socket() noexcept { return OwnedDescriptor(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)); }

}  // namespace

EmulatedHand::EmulatedHand(const std::filesystem::path& socket, std::function<void(HandDeed)> does)
    : socket_(socket), does_(std::move(does)), listens_(new_socket()) {
  const auto address = address_of(socket);
  if (!address) throw InputError(socket, "is too long for a socket, expected a shorter folder");
  ::unlink(socket.c_str());
  if (::bind(listens_.get(), reinterpret_cast<const sockaddr*>(&*address), sizeof *address) != 0)
    throw InputError(socket, std::string(std::strerror(errno)) + ", expected a place for a socket");
  thread_ = std::thread([this] { run(); });
}

EmulatedHand::~EmulatedHand() {
  ends_ = true;
  thread_.join();
  ::unlink(socket_.c_str());
}

void EmulatedHand::run() {
  while (!ends_) {
    pollfd door{listens_.get(), POLLIN, 0};
    if (::poll(&door, 1, kLook_ms) != 1) continue;
    std::uint8_t deed = 0;
    if (::recv(listens_.get(), &deed, 1, MSG_DONTWAIT) == 1 && deed <= static_cast<int>(HandDeed::kReleaseStop))
      does_(static_cast<HandDeed>(deed));
  }
}

bool ask_hand(const std::filesystem::path& socket, HandDeed deed) noexcept {
  const auto address = address_of(socket);
  const OwnedDescriptor line = new_socket();
  const auto byte = static_cast<std::uint8_t>(deed);
  return address && ::sendto(line.get(), &byte, 1, MSG_DONTWAIT | MSG_NOSIGNAL,
                             reinterpret_cast<const sockaddr*>(&*address), sizeof *address) == 1;
}

}  // namespace tankrig::sim
