#include "drivers/camera/v4l2_camera.hpp"

#include <fmt/format.h>
#include <linux/videodev2.h>
#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "core/input_error.hpp"
#include "drivers/camera/v4l2_controls.hpp"
#include "drivers/camera/v4l2_format.hpp"
#include "drivers/camera/v4l2_pictures.hpp"
#include "drivers/camera/v4l2_sequence.hpp"
#include "drivers/camera/v4l2_stamp.hpp"
#include "drivers/camera/v4l2_stream.hpp"

namespace tankrig {
namespace {

constexpr int kErrorsInRow = 3;  // then the stream is not begun again by itself

Duration period_of(double rate_hz) { return rate_hz > 0 ? from_seconds(1 / rate_hz) : Duration{0}; }

/// What the device said when it was opened.
struct Opened {
  V4l2Format format;
  std::vector<V4l2Control> controls;  ///< as set and read back
  std::optional<Duration> exposure;
  std::vector<std::string> warnings;
};

std::optional<Duration> exposure_of(const V4l2Controls& controls) {
  constexpr Duration kUnit = std::chrono::microseconds{100};  // of V4L2_CID_EXPOSURE_ABSOLUTE
  const auto value = controls.get(V4L2_CID_EXPOSURE_ABSOLUTE);
  if (!value || *value <= 0) return std::nullopt;
  return *value * kUnit;
}

/// The last value of each.
void remember(std::vector<V4l2Control>& controls, V4l2Control control) {
  std::erase_if(controls, [&](const V4l2Control& one) { return one.name == control.name; });
  controls.push_back(std::move(control));
}

Opened open_device(V4l2Device& device, const V4l2CameraSettings& settings) {
  Opened opened;
  opened.format = open_v4l2(device, settings, opened.warnings);
  V4l2Controls controls(device);
  if (!settings.keep_automatics) opened.controls = controls.switch_automatics_off(settings.controls, opened.warnings);
  try {
    for (const V4l2Control& control : settings.controls) {
      const std::int32_t got = controls.set(control.name, control.value);
      remember(opened.controls, {controls.find(control.name)->name, got});
      if (got != control.value)
        opened.warnings.push_back(
            fmt::format("control {}: asked for {}, the device has {}", control.name, control.value, got));
    }
  } catch (const InputError& error) {
    throw InputError(settings.name + ": " + settings.device + ": " + error.what());
  }
  opened.exposure = settings.exposure ? settings.exposure : exposure_of(controls);
  if (!opened.exposure) opened.warnings.push_back("the device does not tell its exposure time: give exposure_s");
  return opened;
}

}  // namespace

struct V4l2Camera::Impl {
  Impl(const V4l2CameraSettings& settings_, std::unique_ptr<V4l2Device> device_)
      : settings(settings_),
        device(std::move(device_)),
        opened(open_device(*device, settings)),
        stream(*device),
        pictures(settings, opened.format, opened.exposure) {}

  // ---------------------------------------------------------------------------------------------------- start, stop
  Status start() {
    wanted = true;
    if (lost) {
      look_again_at = device->now();
      const auto back = look_again();
      return back.ok() ? Status{} : Status{back.error()};
    }
    if (stream.running() && !stalled && !broken) return {};
    return begin();
  }

  Status begin() {
    if (std::exchange(unwanted, false))
      pictures.begin_anew();
    else
      pictures.restart();
    const Status started = stream.start(settings.buffers);
    if (!started.ok()) {
      if (started.error().code == ErrorCode::kDisconnected) lose(started.error().os_errno);
      return started;
    }
    stalled = broken = false;
    last_news = last_look = last_empty = device->now();
    return {};
  }

  void stop() noexcept {
    wanted = false;
    unwanted = true;
    stream.stop();
    pictures.forget();
  }

  // ------------------------------------------------------------------------------------------------------- grabbing
  Result<std::optional<Frame>> try_grab() {
    if (!wanted) return std::optional<Frame>{};
    if (lost) return look_again();
    if (auto waiting = pictures.pop()) return delivered(std::move(*waiting));
    if (!stream.running()) return Error{ErrorCode::kNotReady, 0, device->now(), "v4l2: not streaming"};
    note_look();
    // A call looks at each buffer once at most: damaged pictures cannot hold the caller.
    for (int i = 0; i <= stream.buffers(); ++i) {
      const short happened = device->wait(POLLIN, Duration{0});
      if (happened == 0) return nothing();
      v4l2_buffer buffer{};
      const int problem = stream.take(buffer);
      if (problem == EAGAIN && (happened & (POLLERR | POLLHUP | POLLNVAL)) == 0) return nothing();
      if (problem != 0) return failed(problem);
      consume(buffer);
      if (auto frame = pictures.pop()) return delivered(std::move(*frame));
    }
    return std::optional<Frame>{};
  }

  Result<std::optional<Frame>> delivered(Frame frame) {
    ++counters.delivered;
    last_sigma = frame.stamp_sigma;
    return std::optional<Frame>(std::move(frame));
  }

  void note_look() {
    const Stamp now = device->now();
    const Duration period = period_of(opened.format.rate_hz);
    const bool away = period.count() > 0 && now - last_look > period * (stream.buffers() - 1);
    if (away || burst >= stream.buffers()) late = stream.buffers() + 1;
    last_look = now;
  }

  Result<std::optional<Frame>> nothing() {
    last_empty = device->now();
    burst = 0;
    if (stalled || last_empty - last_news < settings.timeout) return std::optional<Frame>{};
    stalled = true;
    ++stalls;
    return Error{ErrorCode::kTimeout, 0, last_empty, "v4l2: no frame within the time-out"};
  }

  void consume(v4l2_buffer& buffer) {
    const Stamp now = device->now();
    const V4l2Taken taken = pictures.add(buffer, stream.memory(buffer), last_empty, now);
    stream.give_back(buffer);
    (late > 0 ? counters.overrun : counters.lost) += taken.missed;
    counters.incomplete += taken.incomplete;
    if (late > 0) --late;
    ++burst;
    last_news = now;
    stalled = false;
    errors_in_row = 0;
  }

  // ------------------------------------------------------------------------------------------------ faults and return
  Result<std::optional<Frame>> failed(int problem) {
    if (code_of_errno(problem) == ErrorCode::kDisconnected) return lose(problem);
    ++stream_errors;
    const Error error{ErrorCode::kIo, problem, device->now(), "v4l2: stream error"};
    if (++errors_in_row > kErrorsInRow) {
      broken = true;
      stream.stop();
      return error;
    }
    const Status again = begin();
    if (!again.ok()) return again.error();
    return std::optional<Frame>{};
  }

  Error lose(int problem) {
    stream.stop();
    device->close();
    pictures.restart();
    lost = true;
    ++disconnects;
    look_again_at = device->now() + settings.retry;
    return gone(problem);
  }

  Error gone(int problem) const { return {ErrorCode::kDisconnected, problem, device->now(), "v4l2: device lost"}; }

  Result<std::optional<Frame>> look_again() {
    if (device->now() < look_again_at) return gone(ENODEV);
    look_again_at = device->now() + settings.retry;
    try {
      Opened again = open_device(*device, settings);
      if (!(again.format == opened.format)) throw InputError("came back with another format");
      opened.controls = std::move(again.controls);
    } catch (const InputError&) {
      device->close();
      return gone(ENODEV);
    }
    lost = false;
    if (const Status started = begin(); !started.ok()) {
      if (lost) --disconnects;  // the same loss
      lost = true;
      device->close();
      return gone(started.error().os_errno);
    }
    ++returns;
    return std::optional<Frame>{};
  }

  const V4l2CameraSettings settings;
  std::unique_ptr<V4l2Device> device;
  Opened opened;
  V4l2Stream stream;
  V4l2Pictures pictures;

  bool wanted = false, lost = false, stalled = false, broken = false;
  bool unwanted = false;  ///< since the stream began last
  Stamp look_again_at{}, last_news{}, last_look{}, last_empty{};
  Duration last_sigma{};
  int burst = 0;  ///< pictures taken since a look found none
  int late = 0;   ///< pictures to come whose gaps are ours: we looked too seldom
  int errors_in_row = 0;
  CameraCounters counters;
  std::uint64_t disconnects = 0, returns = 0, stalls = 0, stream_errors = 0;
};

V4l2Camera::V4l2Camera(const V4l2CameraSettings& settings, std::unique_ptr<V4l2Device> device)
    : impl_(std::make_unique<Impl>(settings, std::move(device))) {}

V4l2Camera::~V4l2Camera() = default;

CameraInfo V4l2Camera::info() const {
  const V4l2Format& format = impl_->opened.format;
  return {impl_->settings.name, format.width, format.picture_height(), impl_->settings.channels,
          format.rate_hz * impl_->pictures.per_frame()};
}

Status V4l2Camera::start() { return impl_->start(); }
Result<std::optional<Frame>> V4l2Camera::try_grab() { return impl_->try_grab(); }
void V4l2Camera::stop() noexcept { impl_->stop(); }
CameraCounters V4l2Camera::counters() const { return impl_->counters; }
const std::vector<std::string>& V4l2Camera::warnings() const { return impl_->opened.warnings; }

std::optional<Stamp> V4l2Camera::next_frame_at() const {
  const Impl& my = *impl_;
  if (!my.wanted) return std::nullopt;
  if (my.lost) return my.look_again_at;
  if (my.burst > 0) return my.last_news;  // more may wait
  constexpr Duration kLookAgain = std::chrono::milliseconds{1};
  return std::max(my.last_news + period_of(my.opened.format.rate_hz), my.last_empty + kLookAgain);
}

void V4l2Camera::wait(Duration timeout) noexcept {
  if (impl_->stream.running()) impl_->device->wait(POLLIN, timeout);
}

Statistics V4l2Camera::statistics() const {
  const Impl& my = *impl_;
  const auto number = [](std::uint64_t n) { return static_cast<double>(n); };
  Statistics all{{"delivered", number(my.counters.delivered)},
                 {"lost", number(my.counters.lost)},
                 {"incomplete", number(my.counters.incomplete)},
                 {"overrun", number(my.counters.overrun)},
                 {"error_buffers", number(my.pictures.counts().error_buffers)},
                 {"damaged_pictures", number(my.pictures.counts().damaged_pictures)},
                 {"unpaired_fields", number(my.pictures.counts().unpaired_fields)},
                 {"stream_errors", number(my.stream_errors)},
                 {"stalls", number(my.stalls)},
                 {"disconnects", number(my.disconnects)},
                 {"returns", number(my.returns)},
                 {"buffers", number(static_cast<std::uint64_t>(my.stream.buffers()))},
                 {"rate_hz", my.opened.format.rate_hz},
                 {"exposure_s", my.opened.exposure ? seconds(*my.opened.exposure) : 0},
                 {"stamps_monotonic", number(my.pictures.counts().monotonic_stamps)},
                 {"stamps_by_arrival", number(my.pictures.counts().arrival_stamps)},
                 {"stamp_at_start", my.pictures.counts().at_start ? 1.0 : 0.0},
                 {"stamp_sigma_s", seconds(my.last_sigma)}};
  for (const V4l2Control& control : my.opened.controls)
    all.push_back({"control_" + control.name, static_cast<double>(control.value)});
  return all;
}

std::string V4l2Camera::description() const {
  const Impl& my = *impl_;
  const V4l2Format& format = my.opened.format;
  std::string text =
      fmt::format("{} at {}: {} {}x{}, field order {}", format.card, my.settings.device, to_string(format.pixel),
                  format.width, format.picture_height(), field_order_name(format.field));
  for (const V4l2Control& control : my.opened.controls) text += fmt::format(", {} {}", control.name, control.value);
  return text;
}

}  // namespace tankrig
