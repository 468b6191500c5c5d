#include "rig/platform/devices.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <grp.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>

#include "drivers/arm/arm5e_settings.hpp"
#include "drivers/can/owned_descriptor.hpp"
#include "rig/platform/first_line.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

constexpr double kBufferSeconds = 0.2;

fs::path below(const fs::path& root, const std::string& absolute) { return root / fs::path(absolute).relative_path(); }

std::string group_of(const fs::path& file) {
  struct stat s {};
  if (::stat(file.c_str(), &s) != 0) return "its group";
  const group* g = ::getgrgid(s.st_gid);
  return g ? g->gr_name : std::to_string(s.st_gid);
}

bool may_use(const fs::path& file) { return ::access(file.c_str(), R_OK | W_OK) == 0; }

/// "NAME (pid N)" of a process that has the file open; empty if none is seen.
std::string holder(const fs::path& root, const fs::path& device) {
  std::error_code error;
  const fs::path target = fs::canonical(device, error);
  for (const fs::directory_entry& process : fs::directory_iterator(root / "proc", error)) {
    const std::string pid = process.path().filename();
    if (pid.find_first_not_of("0123456789") != std::string::npos) continue;
    std::error_code hidden;
    for (const fs::directory_entry& file : fs::directory_iterator(process.path() / "fd", hidden)) {
      std::error_code gone;
      if (fs::read_symlink(file.path(), gone) == target && !gone)
        return first_line(process.path() / "comm") + " (pid " + pid + ")";
    }
  }
  return {};
}

Finding refused(const std::string& what, Verdict verdict, const std::string& measured, const std::string& cure) {
  return {what, verdict, measured, cure, true};
}

/// There, and this user's to open; nothing if so.
std::optional<Finding> not_usable(const std::string& what, const fs::path& file, const std::string& device,
                                  const std::string& plug_in) {
  if (!fs::exists(file)) return refused(what, Verdict::kAbsent, device + " does not exist", plug_in);
  if (!may_use(file))
    return refused(what, Verdict::kBad, device + ": no permission",
                   "usermod -a -G " + group_of(file) + " USER, and log in again");
  return std::nullopt;
}

}  // namespace

std::optional<CanTraffic> can_traffic(const fs::path& root, const std::string& interface, Stamp now) {
  const fs::path counts = root / "sys/class/net" / interface / "statistics";
  if (!fs::exists(counts)) return std::nullopt;
  const auto count = [&](const char* name) { return std::strtoull(first_line(counts / name).c_str(), nullptr, 10); };
  return CanTraffic{now, count("rx_packets") + count("tx_packets"), count("rx_bytes") + count("tx_bytes")};
}

double bus_load(const CanTraffic& from, const CanTraffic& to, int bitrate) noexcept {
  constexpr double kFrameBits = 47, kStuffing = 1.1;  // ISO 11898-1, with the space between frames
  const double bits =
      kFrameBits * static_cast<double>(to.frames - from.frames) + 8 * static_cast<double>(to.bytes - from.bytes);
  return kStuffing * bits / (bitrate * seconds(to.when - from.when));
}

Finding can_finding(const fs::path& root, const CanNeed& need, const std::optional<CanLink>& link,
                    std::optional<double> others) {
  const std::string what = "CAN " + need.interface;
  std::string load = fmt::format("load {:.0f} %", 100 * need.load);
  if (others) load += fmt::format(", and {:.0f} % there now", 100 * *others);
  if (need.interface.starts_with("unix:")) return {"CAN", Verdict::kGood, "emulated, " + load};
  const fs::path net = root / "sys/class/net" / need.interface;
  const std::string up =
      fmt::format("ip link set {} up type can bitrate {} restart-ms 100", need.interface, need.bitrate);
  if (!fs::exists(net))
    return refused(what, Verdict::kAbsent, "no such interface",
                   "plug the adapter in; ip -details link shows those there are");
  const std::string state = first_line(net / "operstate"), queue = first_line(net / "tx_queue_len");
  if (link && link->state == CanState::kBusOff)  // the kernel calls it down too
    return refused(what, Verdict::kBad, "bus-off", "ip link set " + need.interface + " type can restart");
  if (state == "down") return refused(what, Verdict::kBad, "down", up);
  if (link && link->bitrate && *link->bitrate != need.bitrate)
    return refused(what, Verdict::kBad, std::to_string(*link->bitrate) + " bit/s",
                   "ip link set " + need.interface + " down; " + up);
  Finding f{what, Verdict::kGood, fmt::format("{} bit/s, queue {} frames, {}", need.bitrate, queue, load)};
  const int frames = std::atoi(queue.c_str());
  if (need.load > kLargestCarrierLoad)
    return refused(what, Verdict::kBad, f.measured, "a lower devices.arm.can.exchange_rate_hz");
  if (need.load + others.value_or(0) > kLargestCarrierLoad) {
    f.verdict = Verdict::kBad;
    f.cure = "silence who else sends there (candump " + need.interface + " shows them), or lower " +
             "devices.arm.can.exchange_rate_hz";
    return f;
  }
  if (frames < 3 * need.frames_at_once) {
    const bool no_room = frames < 2 * need.frames_at_once;  // for rest behind a demand that nobody takes
    f.verdict = no_room ? Verdict::kBad : Verdict::kUsable;
    f.cure = "ip link set " + need.interface + " txqueuelen 100: behind a demand that waits there is no room for " +
             (no_room ? "rest" : "the guardian's rest");
  } else if (link && link->restart_ms && *link->restart_ms == 0) {
    f.verdict = Verdict::kUsable;
    f.cure = "restart-ms 100 (" + up + "): else a bus-off lasts until somebody restarts it by hand";
  }
  return f;
}

Finding serial_finding(const fs::path& root, const std::string& what, const std::string& device) {
  const fs::path file = below(root, device);
  if (const auto bad = not_usable(what, file, device, "plug it in; ls -l /dev/serial/by-id shows the lines there are"))
    return *bad;
  const std::string taken = holder(root, file);
  if (!taken.empty()) return refused(what, Verdict::kBad, device + " is taken by " + taken, "end that program");
  return {what, Verdict::kGood, device + " is there and free"};
}

Finding v4l2_finding(const fs::path& root, const std::string& camera, const std::string& device) {
  const fs::path file = below(root, device);
  const std::string what = "camera " + camera;
  if (const auto bad = not_usable(what, file, device, "plug it in; v4l2-ctl --list-devices shows those there are"))
    return *bad;
  std::error_code error;
  const fs::path node = fs::canonical(file, error).filename();
  const std::string name = first_line(root / "sys/class/video4linux" / node / "name");
  return {what, Verdict::kGood, device + (name.empty() ? "" : ": " + name)};
}

Finding receive_buffer_finding(const fs::path& root, double bytes_per_s) {
  const double needed = kBufferSeconds * bytes_per_s;
  const double most = std::atof(first_line(root / "proc/sys/net/core/rmem_max").c_str());
  Finding f{"receive buffer", Verdict::kGood,
            fmt::format("at most {:.1f} MB, 0.2 s of the cameras are {:.1f} MB", most * 1e-6, needed * 1e-6)};
  if (most >= needed) return f;
  f.verdict = Verdict::kUsable;
  f.cure = fmt::format("sysctl -w net.core.rmem_max={:.0f}: a late reader loses packets", needed);
  return f;
}

Finding mtu_finding(const std::string& camera, const std::string& interface, int mtu, int packet_bytes) {
  Finding f{"network of camera " + camera, Verdict::kGood, fmt::format("{}, MTU {}", interface, mtu)};
  if (packet_bytes > mtu)
    return {f.what, Verdict::kBad, fmt::format("{}, packets of {}", f.measured, packet_bytes),
            fmt::format("ip link set {} mtu 9000, or a packet_size_bytes of at most {}", interface, mtu), true};
  if (mtu < 8000) {
    f.verdict = Verdict::kUsable;
    f.cure = "ip link set " + interface + " mtu 9000: fewer packets, fewer interrupts";
  }
  return f;
}

std::optional<NetworkInterface> interface_towards(const std::string& address) {
  in_addr wanted{};
  if (::inet_pton(AF_INET, address.c_str(), &wanted) != 1) return std::nullopt;
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return std::nullopt;
  std::string name;
  in_addr_t longest = 0;
  for (const ifaddrs* i = all; i; i = i->ifa_next) {
    if (!i->ifa_addr || !i->ifa_netmask || i->ifa_addr->sa_family != AF_INET) continue;
    const auto own = reinterpret_cast<const sockaddr_in*>(i->ifa_addr)->sin_addr.s_addr;
    const auto mask = reinterpret_cast<const sockaddr_in*>(i->ifa_netmask)->sin_addr.s_addr;
    if (((own ^ wanted.s_addr) & mask) != 0 || (!name.empty() && ntohl(mask) <= longest)) continue;
    name = i->ifa_name;
    longest = ntohl(mask);
  }
  ::freeifaddrs(all);
  if (name.empty()) return std::nullopt;
  const OwnedDescriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  ifreq request{};
  name.copy(request.ifr_name, IFNAMSIZ - 1);
  if (::ioctl(socket.get(), SIOCGIFMTU, &request) != 0) return std::nullopt;
  return NetworkInterface{name, request.ifr_mtu};
}

}  // namespace tankrig
