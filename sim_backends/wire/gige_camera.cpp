#include "sim_backends/wire/gige_camera.hpp"

#include <arv.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <thread>

#include "core/clock.hpp"
#include "core/input_error.hpp"
#include "sim_backends/wire/gige_pixels.hpp"

namespace tankrig::sim {
namespace {

// GigE Vision bootstrap registers (AIA GigE Vision 2.0, chapter 28).
constexpr std::uint32_t kMacHigh = 0x0008, kMacLow = 0x000C, kUserName = 0x00E8, kCapability = 0x0934;
constexpr std::uint32_t kPacketResend = 4;
constexpr std::uint32_t kTimestampControl = 0x0944, kTimestampValue = 0x0948;
constexpr std::uint32_t kTimestampLatch = 2, kTimestampReset = 1;

constexpr std::uint64_t kFirstFrameId = 65401, kFrameIds = 65535;

// An armed latch is looked for often for a while after one was seen, else rarely.
constexpr Duration kLatchIdle = std::chrono::milliseconds(10), kLatchBusy = std::chrono::microseconds(150);
constexpr Duration kLatchBusyFor = std::chrono::milliseconds(60);

}  // namespace

struct GigeCameraEmulator::Impl {
  Impl(const GigeCameraSettings& s, GigePicture p, GigeTruth t)
      : settings(s), picture(std::move(p)), truth(std::move(t)), epoch(clock.now()), clock_ns(s.clock_start_ns) {}

  void power_up() {
    ArvGvFakeCamera* fresh = arv_gv_fake_camera_new(settings.address.c_str(), settings.serial.c_str());
    if (!fresh || !arv_gv_fake_camera_is_running(fresh)) {
      if (fresh) g_object_unref(fresh);
      throw InputError("emulated GigE camera " + settings.serial + ": cannot serve at " + settings.address +
                       ": it must be an address of a network interface of this machine (ip addr add " +
                       settings.address + "/8 dev lo) and its port 3956 must be free");
    }
    ArvFakeCamera* fake = arv_gv_fake_camera_get_fake_camera(fresh);
    const auto set = [fake](std::uint32_t address, double value) {
      arv_fake_camera_write_register(fake, address, static_cast<std::uint32_t>(std::lround(value)));
    };
    set(ARV_FAKE_CAMERA_REGISTER_SENSOR_WIDTH, settings.width);
    set(ARV_FAKE_CAMERA_REGISTER_SENSOR_HEIGHT, settings.height);
    set(ARV_FAKE_CAMERA_REGISTER_WIDTH, settings.width);
    set(ARV_FAKE_CAMERA_REGISTER_HEIGHT, settings.height);
    set(ARV_FAKE_CAMERA_REGISTER_PIXEL_FORMAT, gige_pixel_format(settings.pixel_format));
    set(ARV_FAKE_CAMERA_REGISTER_ACQUISITION_FRAME_PERIOD_US, 1e6 / settings.rate_hz);
    set(ARV_FAKE_CAMERA_REGISTER_EXPOSURE_TIME_US, settings.exposure_us);
    // A locally administered hardware address of its own: a search tells devices apart by it.
    std::uint32_t host = 0;
    for (const char c : settings.address) host = host * 31 + static_cast<unsigned char>(c);
    set(kMacHigh, 0x0254);
    arv_fake_camera_write_register(fake, kMacLow, host);
    if (settings.claims_resend) {
      guint32 capability = 0;
      arv_fake_camera_read_register(fake, kCapability, &capability);
      arv_fake_camera_write_register(fake, kCapability, capability | kPacketResend);
    }
    std::array<char, 16> name{};
    settings.user_id.copy(name.data(), name.size() - 1);
    arv_fake_camera_write_memory(fake, kUserName, name.size(), name.data());
    arv_fake_camera_set_trigger_frequency(fake, settings.trigger_poll_hz);
    last_grid = -1;
    arv_fake_camera_set_fill_pattern(fake, &Impl::fill, this);
    const std::lock_guard lock(mutex);
    server = fresh;
    camera = fake;
    lose(loss);
  }

  void power_down() {
    ArvGvFakeCamera* old = nullptr;
    {
      const std::lock_guard lock(mutex);
      std::swap(old, server);
      camera = nullptr;
    }
    if (old) g_object_unref(old);  // joins its thread
  }

  /// Call with the lock.
  void lose(double ratio) {
    loss = ratio;
    if (server) g_object_set(server, "gvsp-lost-ratio", std::clamp(ratio, 0.0, 1.0), nullptr);
  }

  std::int64_t device_time(Stamp host) const {
    const double elapsed = static_cast<double>((host - epoch).count());
    return clock_ns.load() + (host - epoch).count() + std::llround(elapsed * settings.clock_drift_ppm * 1e-6);
  }

  static void fill(ArvBuffer* buffer, void* self, guint32 exposure_us, guint32, ArvPixelFormat format) {
    static_cast<Impl*>(self)->expose(buffer, exposure_us, format);
  }

  /// In the fake camera's thread, on its tick.
  void expose(ArvBuffer* buffer, std::uint32_t exposure_us, std::uint32_t format);

  /// Answers the timestamp latch, and notices that the acquisition stands still.
  void watch_registers();

  MonotonicClock clock;
  const GigeCameraSettings settings;
  const GigePicture picture;
  const GigeTruth truth;
  const Stamp epoch;
  std::atomic<std::int64_t> clock_ns;
  std::atomic<std::uint64_t> made{0}, skipped{0}, latches{0};
  std::atomic<bool> short_pictures{false};
  std::atomic<bool> idle{false};  ///< not acquiring since the last exposure

  mutable std::mutex mutex;  ///< server, camera, loss, stopping
  std::condition_variable wake;
  ArvGvFakeCamera* server = nullptr;
  ArvFakeCamera* camera = nullptr;
  double loss = 0;
  bool stopping = false;
  std::thread register_thread;

  // The fake camera's thread only.
  std::uint64_t next_index = 0;
  std::int64_t last_grid = -1;
  std::int64_t last_period_us = 0;
};

void GigeCameraEmulator::Impl::expose(ArvBuffer* buffer, std::uint32_t exposure_us, std::uint32_t format) {
  ArvFakeCamera* fake = nullptr;
  {
    const std::lock_guard lock(mutex);
    fake = camera;
  }
  if (!fake) return;
  const auto get = [fake](std::uint32_t address) {
    guint32 value = 0;
    arv_fake_camera_read_register(fake, address, &value);
    return value;
  };
  const Duration exposure = std::chrono::microseconds(exposure_us);
  Stamp begin{};
  if (arv_fake_camera_is_in_software_trigger_mode(fake)) {
    begin = clock.now();
    clock.sleep_until(begin + exposure);
    last_grid = -1;
  } else {
    // The fake camera ticks on multiples of its frame period of the system's time, and comes late, never early.
    const std::int64_t period_us = std::max<std::int64_t>(get(ARV_FAKE_CAMERA_REGISTER_ACQUISITION_FRAME_PERIOD_US), 1);
    const std::int64_t real_us = g_get_real_time();
    const Stamp now = clock.now();
    const std::int64_t grid = real_us / period_us;
    if (idle.exchange(false)) last_grid = -1;
    if (last_grid >= 0 && period_us == last_period_us && grid > last_grid + 1) {
      skipped += static_cast<std::uint64_t>(grid - last_grid - 1);
      next_index += static_cast<std::uint64_t>(grid - last_grid - 1);
    }
    last_grid = grid;
    last_period_us = period_us;
    begin = now - std::chrono::microseconds(real_us % period_us) - exposure;
  }
  const std::uint64_t index = next_index++;
  ++made;

  const cv::Size size(static_cast<int>(get(ARV_FAKE_CAMERA_REGISTER_WIDTH)),
                      static_cast<int>(get(ARV_FAKE_CAMERA_REGISTER_HEIGHT)));
  const cv::Point offset(static_cast<int>(get(ARV_FAKE_CAMERA_REGISTER_X_OFFSET)),
                         static_cast<int>(get(ARV_FAKE_CAMERA_REGISTER_Y_OFFSET)));
  if (truth) truth(index, begin, exposure);
  std::size_t unused = 0;
  auto* data = static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, &unused)));
  write_gige_pixels(picture(index, begin, exposure), offset, size, format, data);
  arv_buffer_set_timestamp(buffer, static_cast<guint64>(device_time(begin)));
  arv_buffer_set_frame_id(buffer, (kFirstFrameId - 1 + index) % kFrameIds + 1);
}

void GigeCameraEmulator::Impl::watch_registers() {
  auto busy_until = std::chrono::steady_clock::now();
  std::unique_lock lock(mutex);
  while (!stopping) {
    guint32 acquiring = 0;
    if (camera) arv_fake_camera_read_register(camera, ARV_FAKE_CAMERA_REGISTER_ACQUISITION, &acquiring);
    if (!acquiring) idle = true;
    if (camera && settings.timestamp_latch) {
      guint32 control = 0;
      arv_fake_camera_read_register(camera, kTimestampControl, &control);
      if (control != 0) {
        const Stamp now = clock.now();
        if (control & kTimestampReset) clock_ns.store(clock_ns.load() - device_time(now));
        if (control & kTimestampLatch) {
          const std::uint64_t value = GUINT64_TO_BE(static_cast<std::uint64_t>(device_time(now)));
          arv_fake_camera_write_memory(camera, kTimestampValue, sizeof value, &value);
          ++latches;
        }
        arv_fake_camera_write_register(camera, kTimestampControl, 0);
        busy_until = std::chrono::steady_clock::now() + kLatchBusyFor;
      }
    }
    if (std::chrono::steady_clock::now() < busy_until)
      wake.wait_for(lock, kLatchBusy);
    else
      wake.wait_for(lock, kLatchIdle);
  }
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
  impl_->register_thread = std::thread([this] { impl_->watch_registers(); });
}

GigeCameraEmulator::~GigeCameraEmulator() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->stopping = true;
  }
  impl_->wake.notify_all();
  impl_->register_thread.join();
  impl_->power_down();
}

void GigeCameraEmulator::lose_packets(double ratio) {
  const std::lock_guard lock(impl_->mutex);
  impl_->lose(ratio);
}

void GigeCameraEmulator::send_short_pictures(bool yes) {
  const std::lock_guard lock(impl_->mutex);
  if (!impl_->camera || impl_->short_pictures.exchange(yes) == yes) return;
  guint32 height = 0;
  arv_fake_camera_read_register(impl_->camera, ARV_FAKE_CAMERA_REGISTER_HEIGHT, &height);
  arv_fake_camera_write_register(impl_->camera, ARV_FAKE_CAMERA_REGISTER_HEIGHT, yes ? height / 2 : height * 2);
}

void GigeCameraEmulator::unplug() { impl_->power_down(); }

void GigeCameraEmulator::plug() {
  impl_->power_down();
  impl_->short_pictures = false;
  impl_->power_up();
}

void GigeCameraEmulator::step_clock(Duration by) { impl_->clock_ns += by.count(); }

std::int64_t GigeCameraEmulator::device_time(Stamp host) const { return impl_->device_time(host); }
std::uint64_t GigeCameraEmulator::exposures() const { return impl_->made; }
std::uint64_t GigeCameraEmulator::skipped() const { return impl_->skipped; }
std::uint64_t GigeCameraEmulator::latches() const { return impl_->latches; }

std::uint32_t GigeCameraEmulator::read_register(std::uint32_t address) const {
  const std::lock_guard lock(impl_->mutex);
  guint32 value = 0;
  if (impl_->camera) arv_fake_camera_read_register(impl_->camera, address, &value);
  return value;
}

}  // namespace tankrig::sim
