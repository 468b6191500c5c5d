#include "drivers/camera/aravis_link.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/input_error.hpp"
#include "drivers/camera/aravis_discovery.hpp"
#include "drivers/camera/aravis_socket.hpp"

namespace tankrig {
namespace {

// GigE Vision bootstrap registers (AIA GigE Vision 2.0, chapter 28).
constexpr std::uint64_t kTimestampControl = 0x0944, kTimestampValue = 0x0948;
constexpr std::uint32_t kTimestampLatch = 2;
constexpr Duration kLatchPatience = std::chrono::milliseconds(60);
constexpr int kMostSilent = 3;  // tries without an answer: no latch

}  // namespace

/// What a buffer carries through Aravis and back.
struct AravisLink::Slot {
  cv::Mat memory;
};

void AravisLink::refuse(const std::string& what, const ArvError& error) const {
  throw InputError("camera " + settings_.info.name + ": " + what + ": " + error.message());
}

void AravisLink::feature(const char* name, const std::string& value, const std::function<void(GError**)>& set) const {
  ArvError error;
  set(error);
  if (error) refuse(std::string("cannot set ") + name + " to " + value, error);
}

AravisLink::AravisLink(const AravisSettings& settings) : settings_(settings), camera_(open_aravis_camera(settings)) {
  configure();
  open_stream();
  for (int i = 0; i < settings_.buffers; ++i) add_buffer();
  lost_handler_ = g_signal_connect(device(), "control-lost", G_CALLBACK(+[](ArvDevice*, gpointer lost) {
                                     static_cast<std::atomic<bool>*>(lost)->store(true);
                                   }),
                                   &control_lost_);
}

AravisLink::~AravisLink() {
  if (lost_handler_) g_signal_handler_disconnect(device(), lost_handler_);
  if (!abandoned_) stop();
}

void AravisLink::configure() {
  ArvError ignored;
  arv_camera_clear_triggers(camera_.get(), ignored);
  set_pixel_format();
  set_region();
  set_exposure();
  set_timing();
  read_back();
}

void AravisLink::set_pixel_format() {
  ArvCamera* c = camera_.get();
  const CameraInfo& info = settings_.info;
  const std::string format = !settings_.pixel_format.empty() ? settings_.pixel_format
                             : info.channels == 3            ? "RGB8"
                                                             : "Mono8";
  const std::optional<AravisPixels> pixels = aravis_pixels(format);
  if (!pixels) throw InputError("camera " + info.name + ": pixel format " + format + " is not supported");
  pixels_ = *pixels;

  ArvError error;
  arv_camera_set_pixel_format_from_string(c, format.c_str(), error);
  if (error) {
    const std::string reason = error.message();
    guint count = 0;
    g_autofree const char** known = arv_camera_dup_available_pixel_formats_as_strings(c, &count, error);
    std::string offers;
    for (guint i = 0; i < count; ++i) offers += std::string(" ") + known[i];
    throw InputError("camera " + info.name + ": cannot set PixelFormat to " + format + ": " + reason + "; it offers" +
                     offers);
  }
}

void AravisLink::set_region() {
  ArvCamera* c = camera_.get();
  const CameraInfo& info = settings_.info;
  ArvError error;
  int sensor_width = 0, sensor_height = 0;
  arv_camera_get_sensor_size(c, &sensor_width, &sensor_height, error);
  if (!error && (settings_.offset_x + info.width > sensor_width || settings_.offset_y + info.height > sensor_height))
    throw InputError(fmt::format("camera {}: a picture of {} x {} at offset {}, {} does not fit its sensor of {} x {}",
                                 info.name, info.width, info.height, settings_.offset_x, settings_.offset_y,
                                 sensor_width, sensor_height));
  feature("the region", fmt::format("{} x {}", info.width, info.height), [&](GError** e) {
    arv_camera_set_region(c, settings_.offset_x, settings_.offset_y, info.width, info.height, e);
  });
}

void AravisLink::set_exposure() {
  ArvCamera* c = camera_.get();
  ArvError error;
  if (arv_camera_is_exposure_auto_available(c, error)) arv_camera_set_exposure_time_auto(c, ARV_AUTO_OFF, error);
  feature("ExposureTime", fmt::format("{:f} us", settings_.exposure_us),
          [&](GError** e) { arv_camera_set_exposure_time(c, settings_.exposure_us, e); });
  if (arv_camera_is_gain_auto_available(c, error)) arv_camera_set_gain_auto(c, ARV_AUTO_OFF, error);
  if (settings_.gain_db)
    feature("Gain", fmt::format("{:f} dB", *settings_.gain_db),
            [&](GError** e) { arv_camera_set_float(c, "Gain", *settings_.gain_db, e); });
  if (settings_.gain_raw)
    feature("GainRaw", std::to_string(*settings_.gain_raw),
            [&](GError** e) { arv_camera_set_integer(c, "GainRaw", *settings_.gain_raw, e); });
}

void AravisLink::set_timing() {
  ArvCamera* c = camera_.get();
  if (settings_.trigger == "off") {
    feature("AcquisitionFrameRate", fmt::format("{:f} Hz", settings_.info.rate_hz),
            [&](GError** e) { arv_camera_set_frame_rate(c, settings_.info.rate_hz, e); });
  } else {
    const std::string source = settings_.trigger == "software" ? "Software" : settings_.trigger;
    feature("TriggerSource", source, [&](GError** e) { arv_camera_set_trigger(c, source.c_str(), e); });
  }
  feature("AcquisitionMode", "Continuous",
          [&](GError** e) { arv_camera_set_acquisition_mode(c, ARV_ACQUISITION_MODE_CONTINUOUS, e); });
  if (settings_.chunk_stamps) {
    feature("ChunkSelector", "Timestamp", [&](GError** e) { arv_camera_set_chunks(c, "Timestamp", e); });
    chunks_.reset(arv_camera_create_chunk_parser(c));
  }
}

void AravisLink::read_back() {
  ArvCamera* c = camera_.get();
  const CameraInfo& info = settings_.info;
  ArvError error;
  exposure_ = from_seconds(arv_camera_get_exposure_time(c, error) * 1e-6);
  if (error) refuse("cannot read ExposureTime back", error);
  rate_hz_ = settings_.trigger == "off" ? arv_camera_get_frame_rate(c, error) : 0;
  if (error || rate_hz_ <= 0) rate_hz_ = info.rate_hz;
  payload_ = arv_camera_get_payload(c, error);
  if (error) refuse("cannot read PayloadSize", error);
  const std::size_t needed = static_cast<std::size_t>(info.width) * static_cast<std::size_t>(info.height) *
                             static_cast<std::size_t>(pixels_.bytes);
  if (payload_ < needed)
    throw InputError(fmt::format("camera {}: its frames have {} bytes, expected {}", info.name, payload_, needed));
}

void AravisLink::open_stream() {
  ArvCamera* c = camera_.get();
  ArvError error;
  gige_ = arv_camera_is_gv_device(c);
  SocketPlan plan;
  if (gige_) {
    auto* gv = ARV_GV_DEVICE(device());
    address_ = settings_.address;
    if (address_.empty()) {
      ArvPtr<GSocketAddress> at(G_SOCKET_ADDRESS(g_object_ref(arv_gv_device_get_device_address(gv))));
      g_autofree gchar* text =
          g_inet_address_to_string(g_inet_socket_address_get_address(G_INET_SOCKET_ADDRESS(at.get())));
      address_ = text;
    }
    plan = plan_socket(settings_.info.name, settings_.socket, payload_, socket_limits());
    packet_socket_ = plan.packet;
    arv_camera_gv_set_stream_options(
        c, plan.packet ? ARV_GV_STREAM_OPTION_NONE : ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
    if (settings_.packet_size > 0)
      arv_camera_gv_set_packet_size(c, settings_.packet_size, error);
    else
      arv_camera_gv_auto_packet_size(c, error);
    if (error) refuse("cannot set the packet size", error);
    packet_size_ = static_cast<int>(arv_camera_gv_get_packet_size(c, error));
    const guint64 ticks = arv_gv_device_get_timestamp_tick_frequency(gv, error);
    ns_per_tick_ = ticks > 0 ? 1e9 / static_cast<double>(ticks) : 0;
    extended_ids_ = false;
    if (arv_camera_is_feature_available(c, "GevGVSPExtendedIDMode", error)) {
      const char* const mode = arv_camera_get_string(c, "GevGVSPExtendedIDMode", error);
      extended_ids_ = mode && std::string_view(mode) == "On";
    }
  } else {
    extended_ids_ = true;
    ns_per_tick_ = 1;
  }
  // By the time it is told of a buffer, its reader may have given it back: nothing in it is touched here.
  const auto told = +[](void* link, ArvStreamCallbackType, ArvBuffer*) { static_cast<AravisLink*>(link)->hand_over(); };
  stream_.reset(arv_camera_create_stream(c, told, this, error));
  if (!stream_) refuse("cannot open its stream", error);
  if (gige_) {
    g_object_set(stream_.get(), "packet-resend",
                 settings_.packet_resend ? ARV_GV_STREAM_PACKET_RESEND_ALWAYS : ARV_GV_STREAM_PACKET_RESEND_NEVER,
                 nullptr);
    if (!plan.packet) {
      g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size",
                   plan.buffer_bytes, nullptr);
      enlarge_receive_buffer(arv_gv_stream_get_port(ARV_GV_STREAM(stream_.get())), plan.buffer_bytes);
    }
  }
}

cv::Mat AravisLink::free_memory() {
  const std::lock_guard lock(memory_mutex_);
  for (cv::Mat& m : memory_)
    if (std::atomic_ref<int>(m.u->refcount).load(std::memory_order_acquire) == 1) return m;
  memory_.emplace_back(1, static_cast<int>(payload_), CV_8UC1);
  return memory_.back();
}

void AravisLink::add_buffer() {
  auto* slot = new Slot{free_memory()};
  hand_over();
  arv_stream_push_buffer(stream_.get(), arv_buffer_new_full(payload_, slot->memory.data, slot,
                                                            [](gpointer s) { delete static_cast<Slot*>(s); }));
}

Status AravisLink::start() {
  const std::lock_guard lock(features_);
  if (acquiring_) return {};
  ArvError error;
  arv_camera_start_acquisition(camera_.get(), error);
  if (error) return Error{ErrorCode::kDisconnected, 0, clock_.now(), "camera: AcquisitionStart"};
  acquiring_ = true;
  return {};
}

void AravisLink::stop() noexcept {
  const std::lock_guard lock(features_);
  if (!acquiring_) return;
  acquiring_ = false;
  ArvError error;
  if (!control_lost_) arv_camera_stop_acquisition(camera_.get(), error);
}

Status AravisLink::trigger() {
  const std::lock_guard lock(features_);
  ArvError error;
  arv_camera_software_trigger(camera_.get(), error);
  if (error) return Error{ErrorCode::kIo, 0, clock_.now(), "camera: TriggerSoftware"};
  return {};
}

AravisLink::Flushed AravisLink::flush() noexcept {
  Flushed flushed;
  while (ArvBuffer* left = arv_stream_try_pop_buffer(stream_.get())) {
    hand_over();
    ++(arv_buffer_get_status(left) == ARV_BUFFER_STATUS_SUCCESS ? flushed.whole : flushed.torn);
    hand_over();
    arv_stream_push_buffer(stream_.get(), left);
  }
  return flushed;
}

std::int64_t AravisLink::device_stamp(ArvBuffer* buffer) const {
  if (chunks_ && arv_buffer_has_chunks(buffer)) {
    ArvError error;
    const gint64 ticks = arv_chunk_parser_get_integer_value(chunks_.get(), buffer, "ChunkTimestamp", error);
    if (!error) return std::llround(static_cast<double>(ticks) * ns_per_tick_);
  }
  return static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer));
}

std::optional<AravisReceived> AravisLink::pop() {
  ArvBuffer* buffer = arv_stream_try_pop_buffer(stream_.get());
  if (!buffer) return std::nullopt;
  hand_over();
  const auto* slot = static_cast<const Slot*>(arv_buffer_get_user_data(buffer));
  AravisReceived received;
  received.id = arv_buffer_get_frame_id(buffer);
  // Aravis keeps the first packet's arrival in system time, which may be set; while it is fresh its age is good.
  const std::int64_t age_ns =
      g_get_real_time() * 1000 - static_cast<std::int64_t>(arv_buffer_get_system_timestamp(buffer));
  received.arrival = clock_.now() - Duration{std::max<std::int64_t>(age_ns, 0)};
  const ArvBufferStatus status = arv_buffer_get_status(buffer);
  const cv::Size size(settings_.info.width, settings_.info.height);
  if (status == ARV_BUFFER_STATUS_SIZE_MISMATCH) {
    received.state = AravisReceived::State::kShort;
  } else if (status != ARV_BUFFER_STATUS_SUCCESS) {
    received.state = AravisReceived::State::kIncomplete;
  } else if (arv_buffer_get_image_width(buffer) != size.width || arv_buffer_get_image_height(buffer) != size.height) {
    received.state = AravisReceived::State::kShort;
  } else {
    received.device_ns = device_stamp(buffer);
    received.image = picture_from(slot->memory, size, pixels_, settings_.info.channels);
    if (received.image.u == slot->memory.u) {
      g_object_unref(buffer);
      add_buffer();
      return received;
    }
  }
  hand_over();
  arv_stream_push_buffer(stream_.get(), buffer);
  return received;
}

Result<std::optional<ClockSample>> AravisLink::read_clock(int tries) {
  if (!gige_ || ns_per_tick_ <= 0) return std::optional<ClockSample>{};
  std::optional<ClockSample> best;
  ArvError error;
  std::uint64_t known = 0;
  int silent = 0;
  if (!arv_device_read_memory(device(), kTimestampValue, sizeof known, &known, error))
    return Error{ErrorCode::kDisconnected, 0, clock_.now(), "camera: timestamp latch"};
  for (int i = 0; i < tries; ++i) {
    Stamp before = clock_.now();
    const Stamp deadline = before + kLatchPatience;
    if (!arv_device_write_register(device(), kTimestampControl, kTimestampLatch, error))
      return Error{ErrorCode::kDisconnected, 0, clock_.now(), "camera: timestamp latch"};
    for (;;) {
      const Stamp asked = clock_.now();
      std::uint64_t value = 0;
      if (!arv_device_read_memory(device(), kTimestampValue, sizeof value, &value, error))
        return Error{ErrorCode::kDisconnected, 0, clock_.now(), "camera: timestamp latch"};
      const Stamp after = clock_.now();
      if (value != known) {
        known = value;
        const Duration width = after - before;
        const Duration sigma = from_seconds(seconds(width) / std::sqrt(12.0));
        if (!best || sigma < best->sigma)
          best = ClockSample{std::llround(static_cast<double>(GUINT64_FROM_BE(value)) * ns_per_tick_),
                             before + width / 2, sigma};
        break;
      }
      before = asked;  // not latched when it was asked last, so latched later than that
      if (after > deadline) {
        if (++silent == kMostSilent) return best;
        break;
      }
    }
  }
  return best;
}

bool AravisLink::answers() const {
  constexpr Duration kPatience = std::chrono::milliseconds(400);
  return gige_ ? gige_device_answers(address_, kPatience) : !control_lost_;
}

AravisStreamCounts AravisLink::counts() const {
  AravisStreamCounts counts;
  guint64 completed = 0, failures = 0, underruns = 0, resent = 0, missing = 0;
  arv_stream_get_statistics(stream_.get(), &completed, &failures, &underruns);
  if (gige_) arv_gv_stream_get_statistics(ARV_GV_STREAM(stream_.get()), &resent, &missing);
  return {completed, failures, underruns, resent, missing};
}

}  // namespace tankrig
