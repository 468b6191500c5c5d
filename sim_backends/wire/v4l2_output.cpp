#include "sim_backends/wire/v4l2_output.hpp"

#include <fmt/format.h>
#include <linux/videodev2.h>
#include <poll.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "core/clock.hpp"
#include "core/input_error.hpp"
#include "sim_backends/wire/v4l2_encode.hpp"

namespace tankrig::sim {
namespace {

constexpr Duration kPatience = std::chrono::milliseconds{20};  // for a free buffer

std::string what_to_do(int problem) {
  switch (problem) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
      return "no such device: sudo modprobe v4l2loopback video_nr=10 exclusive_caps=1";
    case EACCES:
    case EPERM:
      return "no permission: sudo usermod -aG video $USER, then log in again";
    case EBUSY:
      return "in use by another writer: close it (fuser -v DEVICE names it)";
    case ENOTTY:
      return "not a video device, expected an output device such as v4l2loopback's";
    default:
      return std::string("cannot be opened: ") + std::strerror(problem);
  }
}

/// The output device, its format set, by mapped buffers or by write().
class Output {
 public:
  Output(const V4l2OutputSettings& settings, V4l2Device& device) : settings_(settings), device_(device) {
    if (const int problem = device_.open(settings.device); problem != 0) fail(what_to_do(problem));
    check_capabilities();
    set_format();
    if (settings.stamped && map_buffers()) return;
    // A loopback captures from its first picture on: a black one, so that readers may open it now.
    written_.resize(size_);
    if (const int problem = device_.write(written_.data(), size_); problem != 0) fail(what_to_do(problem));
  }
  ~Output() {
    int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    // v4l2loopback frees the output again only for a writer that had its stream on, which write() alone does not do.
    if (buffers_.empty()) device_.call(VIDIOC_STREAMON, &type);
    device_.call(VIDIOC_STREAMOFF, &type);
    for (const auto memory : buffers_) device_.unmap(memory.data(), memory.size());
    device_.close();
  }
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  /// Where the next picture goes; empty if the device has no room.
  std::span<std::uint8_t> room() {
    if (buffers_.empty()) return written_;
    if (fresh_ < buffers_.size()) {
      index_ = static_cast<std::uint32_t>(fresh_);
      return buffers_[index_];
    }
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    buffer.memory = V4L2_MEMORY_MMAP;
    int problem = device_.call(VIDIOC_DQBUF, &buffer);
    if (problem == EAGAIN && device_.wait(POLLOUT, kPatience) != 0) problem = device_.call(VIDIOC_DQBUF, &buffer);
    if (problem != 0 || buffer.index >= buffers_.size()) return {};
    index_ = buffer.index;
    return buffers_[index_];
  }

  /// Sends what was put into room(); 0 or errno.
  int send(Stamp stamp) {
    if (buffers_.empty()) return device_.write(written_.data(), size_);
    v4l2_buffer buffer{};
    buffer.index = index_;
    buffer.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.field = V4L2_FIELD_NONE;
    buffer.bytesused = static_cast<std::uint32_t>(size_);
    buffer.flags = V4L2_BUF_FLAG_TIMESTAMP_COPY;
    buffer.timestamp.tv_sec = static_cast<time_t>(stamp.ns / 1'000'000'000);
    buffer.timestamp.tv_usec = static_cast<suseconds_t>(stamp.ns % 1'000'000'000 / 1000);
    const int problem = device_.call(VIDIOC_QBUF, &buffer);
    if (problem == 0 && fresh_ < buffers_.size()) ++fresh_;
    return problem;
  }

  std::size_t stride() const { return stride_; }

 private:
  [[noreturn]] void fail(const std::string& message) const { throw InputError(settings_.device + ": " + message); }

  void check_capabilities() {
    v4l2_capability capability{};
    if (const int problem = device_.call(VIDIOC_QUERYCAP, &capability); problem != 0)
      fail(what_to_do(problem == EINVAL ? ENOTTY : problem));
    const std::uint32_t can =
        capability.capabilities & V4L2_CAP_DEVICE_CAPS ? capability.device_caps : capability.capabilities;
    if (!(can & V4L2_CAP_VIDEO_OUTPUT))
      fail("is no output device, or has a writer already: expected v4l2loopback's, unused");
    streams_ = can & V4L2_CAP_STREAMING;
  }

  void set_format() {
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    v4l2_pix_format& pix = format.fmt.pix;
    pix.width = static_cast<std::uint32_t>(settings_.width);
    pix.height = static_cast<std::uint32_t>(settings_.height);
    pix.pixelformat = fourcc_of(settings_.format);
    pix.field = V4L2_FIELD_NONE;
    pix.colorspace = V4L2_COLORSPACE_SRGB;
    if (const int problem = device_.call(VIDIOC_S_FMT, &format); problem != 0) fail(what_to_do(problem));
    if (pix.pixelformat != fourcc_of(settings_.format) || pix.width != static_cast<std::uint32_t>(settings_.width) ||
        pix.height != static_cast<std::uint32_t>(settings_.height))
      fail(fmt::format("takes only {} {}x{} now: close its readers, or ask for that", fourcc_text(pix.pixelformat),
                       pix.width, pix.height));
    stride_ = std::max<std::size_t>(pix.bytesperline, row_bytes(settings_.format, settings_.width));
    size_ = picture_bytes(settings_.format, settings_.width, settings_.height, stride_);
    v4l2_streamparm parameters{};
    parameters.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    parameters.parm.output.timeperframe = {1000, static_cast<std::uint32_t>(settings_.rate_hz * 1000 + 0.5)};
    device_.call(VIDIOC_S_PARM, &parameters);
  }

  bool map_buffers() {
    if (!streams_) return false;
    v4l2_requestbuffers request{};
    request.count = 4;
    request.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    request.memory = V4L2_MEMORY_MMAP;
    if (device_.call(VIDIOC_REQBUFS, &request) != 0) return false;
    for (std::uint32_t i = 0; i < request.count; ++i) {
      v4l2_buffer buffer{};
      buffer.index = i;
      buffer.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
      buffer.memory = V4L2_MEMORY_MMAP;
      std::uint8_t* memory = nullptr;
      if (device_.call(VIDIOC_QUERYBUF, &buffer) == 0) memory = device_.map(buffer.length, buffer.m.offset);
      if (!memory) fail("its buffers cannot be mapped");
      buffers_.emplace_back(memory, buffer.length);
    }
    int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    if (const int problem = device_.call(VIDIOC_STREAMON, &type); problem != 0) fail(what_to_do(problem));
    return !buffers_.empty();
  }

  const V4l2OutputSettings& settings_;
  V4l2Device& device_;
  bool streams_ = false;
  std::size_t stride_ = 0, size_ = 0;
  std::vector<std::span<std::uint8_t>> buffers_;
  std::size_t fresh_ = 0;  ///< buffers the device has seen
  std::uint32_t index_ = 0;
  std::vector<std::uint8_t> written_;
};

}  // namespace

struct V4l2OutputEmulator::Impl {
  Impl(const V4l2OutputSettings& settings_, PictureSource source_, std::unique_ptr<V4l2Device> device_)
      : settings(settings_), source(std::move(source_)), device(std::move(device_)), output(settings, *device) {
    epoch = device->now();
    thread = std::thread([this] { run(); });
  }
  ~Impl() {
    {
      const std::lock_guard lock(mutex);
      stopping = true;
    }
    wake.notify_all();
    thread.join();
  }

  Stamp begin_of(std::uint64_t index) const {
    return epoch + from_seconds(static_cast<double>(index) / settings.rate_hz);
  }
  Stamp end_of(std::uint64_t index) const { return begin_of(index) + settings.exposure + settings.readout; }

  /// False when it is time to stop.
  bool sleep_until(Stamp when) {
    const std::chrono::steady_clock::time_point until{Duration{when.ns}};  // CLOCK_MONOTONIC here
    std::unique_lock lock(mutex);
    return !wake.wait_until(lock, until, [this] { return stopping; });
  }

  void run() {
    const Duration period = from_seconds(1 / settings.rate_hz);
    for (std::uint64_t index = 0; sleep_until(end_of(index)); ++index) {
      const Stamp now = device->now();
      while (end_of(index) + period < now) {
        ++index;
        ++skipped;
      }
      if (!stalled) show(index);
    }
  }

  void show(std::uint64_t index) {
    const cv::Mat picture = source(index, begin_of(index), settings.exposure);
    const std::span<std::uint8_t> room = output.room();
    if (room.empty()) {
      ++failed;
    } else if (picture.cols != settings.width || picture.rows != settings.height ||
               !encode(picture, settings.format, output.stride(), room)) {
      ++refused;
    } else {
      ++(output.send(end_of(index)) == 0 ? written : failed);
    }
  }

  const V4l2OutputSettings settings;
  const PictureSource source;
  std::unique_ptr<V4l2Device> device;
  Output output;
  Stamp epoch{};
  std::atomic<std::uint64_t> written{0}, skipped{0}, refused{0}, failed{0};
  std::atomic<bool> stalled{false};
  std::mutex mutex;
  std::condition_variable wake;
  bool stopping = false;
  std::thread thread;
};

V4l2OutputEmulator::V4l2OutputEmulator(const V4l2OutputSettings& settings, PictureSource source,
                                       std::unique_ptr<V4l2Device> device)
    : impl_(std::make_unique<Impl>(settings, std::move(source), std::move(device))) {}

V4l2OutputEmulator::~V4l2OutputEmulator() = default;

Stamp V4l2OutputEmulator::epoch() const { return impl_->epoch; }
void V4l2OutputEmulator::stall(bool stalled) { impl_->stalled = stalled; }

Statistics V4l2OutputEmulator::statistics() const {
  const auto number = [](const std::atomic<std::uint64_t>& n) { return static_cast<double>(n.load()); };
  return {{"written", number(impl_->written)},
          {"skipped", number(impl_->skipped)},
          {"refused", number(impl_->refused)},
          {"failed", number(impl_->failed)}};
}

}  // namespace tankrig::sim
