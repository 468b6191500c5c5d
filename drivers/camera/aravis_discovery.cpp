#include "drivers/camera/aravis_discovery.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <mutex>

#include "core/clock.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

std::mutex& discovery_mutex() {
  static std::mutex mutex;  // Aravis keeps one list of devices per process
  return mutex;
}

std::string or_empty(const char* text) { return text ? text : ""; }

std::string list_of(const std::vector<AravisDevice>& devices) {
  if (devices.empty()) return "no camera answered";
  std::string text = "found";
  const char* separator = " ";
  for (const AravisDevice& d : devices) {
    text += separator + d.vendor + " " + d.model + " serial " + d.serial;
    if (!d.address.empty()) text += " at " + d.address;
    separator = ", ";
  }
  return text;
}

struct Answer {
  bool answered = false, denied = false;
  std::uint32_t value = 0;
};

/// READREG, beside Aravis and without taking control. Source: AIA GigE Vision 2.0, chapters 14 and 16.
Answer read_register(const std::string& address, std::uint32_t reg, Duration timeout) {
  constexpr int kTries = 4;
  constexpr std::uint16_t kPort = 3956;
  constexpr std::uint8_t kIdHigh = 0x12, kIdLow = 0x34;
  const auto byte = [reg](int shift) { return static_cast<std::uint8_t>(reg >> shift); };
  const std::array<std::uint8_t, 12> command = {0x42,    0x01,   0x00,     0x80,     0x00,    0x04,
                                                kIdHigh, kIdLow, byte(24), byte(16), byte(8), byte(0)};
  Answer answer;
  sockaddr_in device{};
  device.sin_family = AF_INET;
  device.sin_port = htons(kPort);
  if (::inet_pton(AF_INET, address.c_str(), &device.sin_addr) != 1) return answer;
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return answer;
  const int wait_ms = std::max<int>(1, static_cast<int>(timeout / std::chrono::milliseconds(kTries)));
  for (int i = 0; i < kTries && !answer.answered; ++i) {
    ::sendto(fd, command.data(), command.size(), 0, reinterpret_cast<const sockaddr*>(&device), sizeof device);
    pollfd event{fd, POLLIN, 0};
    if (::poll(&event, 1, wait_ms) <= 0) continue;
    std::array<std::uint8_t, 64> ack{};
    const ssize_t size = ::recv(fd, ack.data(), ack.size(), 0);
    answer.answered = size >= 8 && ack[6] == kIdHigh && ack[7] == kIdLow;
    answer.denied = answer.answered && (size < 12 || ack[0] != 0 || ack[1] != 0);
    for (int k = 8; k < 12; ++k) answer.value = answer.value << 8 | ack[static_cast<std::size_t>(k)];
  }
  ::close(fd);
  return answer;
}

/// A program that died leaves its control for the length of its heartbeat time-out; that is waited for.
bool controlled_by_another(const std::string& address, Duration patience) {
  constexpr std::uint32_t kControlPrivilege = 0x0A00;
  constexpr Duration kPause = std::chrono::milliseconds(40), kAnswer = std::chrono::milliseconds(400);
  MonotonicClock clock;
  const Stamp deadline = clock.now() + patience;
  for (;;) {
    const Answer answer = read_register(address, kControlPrivilege, kAnswer);
    if (!answer.answered || (!answer.denied && answer.value == 0)) return false;
    if (clock.now() >= deadline) return true;
    clock.sleep_until(clock.now() + kPause);
  }
}

[[noreturn]] void refuse(const AravisSettings& settings, const std::string& reason) {
  throw InputError("camera " + settings.info.name + ": " + reason);
}

/// Address (or identifier) of the device with the serial number.
std::string search(const AravisSettings& settings) {
  const MonotonicClock clock;
  const Stamp deadline = clock.now() + settings.discovery_timeout;
  for (;;) {
    const std::vector<AravisDevice> devices = find_aravis_devices();
    for (const AravisDevice& d : devices)
      if (d.serial == settings.serial) return d.address.empty() ? d.id : d.address;
    if (clock.now() >= deadline)
      refuse(settings, "no camera with serial " + settings.serial + " (" + list_of(devices) +
                           "): check power, cable and that its address is in this machine's subnet");
  }
}

}  // namespace

std::vector<AravisDevice> find_aravis_devices() {
  const std::lock_guard lock(discovery_mutex());
  arv_update_device_list();
  std::vector<AravisDevice> devices;
  const unsigned int count = arv_get_n_devices();
  for (unsigned int i = 0; i < count; ++i)
    devices.push_back({or_empty(arv_get_device_address(i)), or_empty(arv_get_device_serial_nbr(i)),
                       or_empty(arv_get_device_vendor(i)), or_empty(arv_get_device_model(i)),
                       or_empty(arv_get_device_id(i))});
  return devices;
}

ArvPtr<ArvCamera> open_aravis_camera(const AravisSettings& settings) {
  const std::string where = settings.address.empty() ? search(settings) : settings.address;
  in_addr unused{};
  const bool network = ::inet_pton(AF_INET, where.c_str(), &unused) == 1;
  if (network && !gige_device_answers(where, settings.discovery_timeout))
    refuse(settings, "no GigE Vision camera answers at " + where + " (" + list_of(find_aravis_devices()) +
                         "): check power, cable and address");
  const auto refuse_controlled = [&] {
    refuse(settings, "the camera at " + where +
                         " is controlled by another program (Controller privilege required): close that program");
  };
  if (network && controlled_by_another(where, settings.discovery_timeout)) refuse_controlled();
  ArvError error;
  ArvPtr<ArvCamera> camera;
  {
    const std::lock_guard lock(discovery_mutex());
    camera.reset(arv_camera_new(where.c_str(), error));
  }
  if (!camera) refuse(settings, "cannot open the camera at " + where + ": " + error.message());
  if (arv_camera_is_gv_device(camera.get()) &&
      !arv_gv_device_is_controller(ARV_GV_DEVICE(arv_camera_get_device(camera.get()))))
    refuse_controlled();
  if (!settings.serial.empty() && !settings.address.empty()) {
    const std::string serial = or_empty(arv_camera_get_device_serial_number(camera.get(), error));
    if (serial != settings.serial)
      refuse(settings, "the camera at " + where + " has serial " + serial + ", expected " + settings.serial);
  }
  return camera;
}

bool gige_device_answers(const std::string& address, Duration timeout) {
  constexpr std::uint32_t kVersion = 0x0000;
  return read_register(address, kVersion, timeout).answered;
}

}  // namespace tankrig
