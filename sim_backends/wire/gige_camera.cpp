#include "sim_backends/wire/gige_camera.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <mutex>
#include <thread>
#include <vector>

#include "core/clock.hpp"
#include "core/input_error.hpp"
#include "sim_backends/wire/gige_control.hpp"
#include "sim_backends/wire/gige_exposures.hpp"
#include "sim_backends/wire/gige_pixels.hpp"
#include "sim_backends/wire/gige_registers.hpp"
#include "sim_backends/wire/gige_stream.hpp"

namespace tankrig::sim {
namespace {

using namespace gige_register;

constexpr std::uint32_t kPacketResend = 4;
constexpr std::uint32_t kTimestampLatch = 2, kTimestampReset = 1;
constexpr std::uint64_t kFirstFrameId = 65401, kFrameIds = 65535;

}  // namespace

/// What lasts while the camera is unplugged.
struct GigeCameraEmulator::Impl {
  struct Device;

  Impl(const GigeCameraSettings& s, GigePicture p, GigeTruth t)
      : settings(s), picture(std::move(p)), truth(std::move(t)), epoch(clock.now()), clock_ns(s.clock_start_ns) {}

  void power_up();
  void power_down();

  std::int64_t device_time(Stamp host) const {
    const double elapsed = static_cast<double>((host - epoch).count());
    return clock_ns.load() + (host - epoch).count() + std::llround(elapsed * settings.clock_drift_ppm * 1e-6);
  }

  MonotonicClock clock;
  const GigeCameraSettings settings;
  const GigePicture picture;
  const GigeTruth truth;
  const Stamp epoch;
  std::atomic<std::int64_t> clock_ns;
  GigeExposureCounts counts;
  std::atomic<std::uint64_t> sent{0}, latches{0};
  std::atomic<double> loss{0};
  std::atomic<bool> short_pictures{false};

  mutable std::mutex mutex;  ///< device
  std::unique_ptr<Device> device;
};

/// The camera under power: one thread answers its client, one exposes, makes pictures and sends them.
struct GigeCameraEmulator::Impl::Device {
  explicit Device(Impl& emulator)
      : impl(emulator),
        registers(impl.settings.serial),
        exposures(registers, impl.counts),
        stream(impl.settings.address, registers, impl.loss) {
    set_up();
    control = std::make_unique<GigeControl>(
        impl.settings.address, registers,
        [this](std::uint32_t address, std::uint32_t value, Stamp arrival) { written(address, value, arrival); });
    thread = std::thread([this] {
      while (const auto exposure = exposures.next()) send(*exposure);
    });
  }

  ~Device() {
    control.reset();
    exposures.end();
    thread.join();
  }

  void set_up();
  void written(std::uint32_t address, std::uint32_t value, Stamp arrival);
  void latch(std::uint32_t what, Stamp when);
  bool possible(const GigeFrame& frame) const;
  void send(const GigeExposures::Exposure& exposure);

  Impl& impl;
  GigeRegisters registers;
  GigeExposures exposures;
  GigeStream stream;
  std::vector<std::uint8_t> data;
  std::unique_ptr<GigeControl> control;
  std::thread thread;
};

void GigeCameraEmulator::Impl::Device::set_up() {
  const GigeCameraSettings& s = impl.settings;
  const auto set = [this](std::uint32_t address, double value) {
    registers.set(address, static_cast<std::uint32_t>(std::lround(value)));
  };
  set(kSensorWidth, s.width);
  set(kSensorHeight, s.height);
  set(kWidth, s.width);
  set(kHeight, s.height);
  set(kPixelFormat, gige_pixel_format(s.pixel_format));
  set(kFramePeriodUs, 1e6 / s.rate_hz);
  set(kExposureUs, s.exposure_us);
  // A locally administered hardware address of its own: a search tells devices apart by it.
  std::uint32_t host = 0;
  for (const char c : s.address) host = host * 31 + static_cast<unsigned char>(c);
  set(kMacHigh, 0x0254);
  registers.set(kMacLow, host);
  if (s.claims_resend) registers.set(kCapability, registers.get(kCapability) | kPacketResend);
  std::array<std::uint8_t, 16> name{};
  std::copy_n(s.user_id.begin(), std::min(s.user_id.size(), name.size() - 1), name.begin());
  registers.write(kUserName, name);
}

/// In the control thread.
void GigeCameraEmulator::Impl::Device::written(std::uint32_t address, std::uint32_t value, Stamp arrival) {
  if (address == kTimestampControl)
    latch(value, arrival);
  else
    exposures.written(address, value, arrival);
}

void GigeCameraEmulator::Impl::Device::latch(std::uint32_t what, Stamp when) {
  if (!impl.settings.timestamp_latch) return;
  if (what & kTimestampReset) impl.clock_ns -= impl.device_time(when);
  if (what & kTimestampLatch) {
    const auto value = static_cast<std::uint64_t>(impl.device_time(when));
    registers.set(kTimestampValue, static_cast<std::uint32_t>(value >> 32));
    registers.set(kTimestampValue + 4, static_cast<std::uint32_t>(value));
    ++impl.latches;
  }
  registers.set(kTimestampControl, 0);
}

/// A client may write anything into the registers; a camera sends nothing then.
bool GigeCameraEmulator::Impl::Device::possible(const GigeFrame& frame) const {
  const cv::Rect sensor(0, 0, impl.settings.width, impl.settings.height);
  const auto within = [](int value, int least, int most) { return least <= value && value <= most; };
  return is_gige_format(frame.pixel_format) && within(frame.size.width, 1, sensor.width) &&
         within(frame.size.height, 1, sensor.height) && within(frame.offset.x, 0, sensor.width) &&
         within(frame.offset.y, 0, sensor.height);
}

void GigeCameraEmulator::Impl::Device::send(const GigeExposures::Exposure& exposure) {
  GigeFrame frame;
  frame.id = static_cast<std::uint16_t>((kFirstFrameId - 1 + exposure.index) % kFrameIds + 1);
  frame.timestamp = static_cast<std::uint64_t>(impl.device_time(exposure.begin));
  frame.pixel_format = registers.get(kPixelFormat);
  const auto pixels = [this](std::uint32_t address) { return static_cast<int>(registers.get(address)); };
  frame.size = {pixels(kWidth), pixels(kHeight)};
  frame.offset = {pixels(kOffsetX), pixels(kOffsetY)};
  if (!possible(frame)) return;
  if (impl.short_pictures) frame.size.height /= 2;
  if (impl.truth) impl.truth(exposure.index, exposure.begin, exposure.length);
  const cv::Mat picture = impl.picture(exposure.index, exposure.begin, exposure.length);
  data.resize(gige_bytes(frame.size, frame.pixel_format));
  write_gige_pixels(picture, frame.offset, frame.size, frame.pixel_format, data.data());
  frame.data = data;
  if (!exposures.wanted(exposure)) return;
  stream.send(frame);
  ++impl.sent;
}

void GigeCameraEmulator::Impl::power_up() {
  auto fresh = std::make_unique<Device>(*this);
  if (!fresh->control->serving() || !fresh->stream.ready())
    throw InputError("emulated GigE camera " + settings.serial + ": cannot serve at " + settings.address +
                     ": it must be an address of a network interface of this machine (ip addr add " + settings.address +
                     "/8 dev lo) and its port 3956 must be free. `tankrig emulate ... -- COMMAND` serves it on a "
                     "network of its own, `--device` leaves cameras out");
  const std::lock_guard lock(mutex);
  device = std::move(fresh);
}

void GigeCameraEmulator::Impl::power_down() {
  std::unique_ptr<Device> old;
  const std::lock_guard lock(mutex);
  old.swap(device);
}

GigeCameraEmulator::GigeCameraEmulator(const GigeCameraSettings& settings, GigePicture picture, GigeTruth truth)
    : impl_(std::make_unique<Impl>(settings, std::move(picture), std::move(truth))) {
  const auto check = [&](bool good, const char* expected) {
    if (!good) throw InputError("emulated GigE camera " + settings.serial + ": " + expected);
  };
  check(!settings.serial.empty() && settings.serial.size() <= 15, "expected a serial number of 1 to 15 characters");
  check(settings.user_id.size() <= 15, "expected a user_id of at most 15 characters");
  check(gige_pixel_format(settings.pixel_format) != 0,
        "pixel_format is none of Mono8, Mono16, RGB8, Bayer{RG,GB,GR,BG}8");
  check(settings.width > 0 && settings.height > 0 && settings.width <= 8192 && settings.height <= 8192,
        "expected a sensor of at most 8192 x 8192");
  check(settings.rate_hz >= 0.1 && settings.rate_hz <= 1000, "expected rate_hz in 0.1 .. 1000");
  impl_->power_up();
}

GigeCameraEmulator::~GigeCameraEmulator() = default;

void GigeCameraEmulator::lose_packets(double ratio) { impl_->loss = std::clamp(ratio, 0.0, 1.0); }
void GigeCameraEmulator::send_short_pictures(bool yes) { impl_->short_pictures = yes; }
void GigeCameraEmulator::unplug() { impl_->power_down(); }

void GigeCameraEmulator::plug() {
  impl_->power_down();
  impl_->short_pictures = false;
  impl_->power_up();
}

void GigeCameraEmulator::step_clock(Duration by) { impl_->clock_ns += by.count(); }

std::int64_t GigeCameraEmulator::device_time(Stamp host) const { return impl_->device_time(host); }
std::uint64_t GigeCameraEmulator::exposures() const { return impl_->counts.made; }
std::uint64_t GigeCameraEmulator::skipped() const { return impl_->counts.skipped; }
std::uint64_t GigeCameraEmulator::triggers_ignored() const { return impl_->counts.ignored; }
std::uint64_t GigeCameraEmulator::sent() const { return impl_->sent; }
std::uint64_t GigeCameraEmulator::latches() const { return impl_->latches; }

std::uint32_t GigeCameraEmulator::read_register(std::uint32_t address) const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->device ? impl_->device->registers.get(address) : 0;
}

}  // namespace tankrig::sim
