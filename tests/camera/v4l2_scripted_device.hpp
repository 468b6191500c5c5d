// A V4L2 device that does what its test says, faults included, on a clock that its test turns.
#pragma once

#include <linux/videodev2.h>
#include <poll.h>

#include <cerrno>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "drivers/camera/v4l2_device.hpp"

namespace tankrig {

/// What the device is, and what becomes of it; the test keeps it when the driver has the device.
struct V4l2Script {
  struct Control {
    std::string name;
    std::uint32_t type = V4L2_CTRL_TYPE_INTEGER;
    std::int32_t minimum = 0, maximum = 1000, value = 0;
    int refuses = 0;  ///< errno of setting it
  };
  struct Delivery {
    std::uint32_t flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    std::uint32_t field = V4L2_FIELD_NONE;
    std::size_t cut = 0;  ///< bytes missing
  };

  Stamp now{Duration{std::chrono::seconds{100}}.count()};
  bool present = true;
  int open_fails = 0;
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::vector<std::uint32_t> offered{V4L2_PIX_FMT_GREY};
  std::uint32_t width = 8, height = 4;  ///< the only size, of a frame
  std::uint32_t padding = 0;            ///< bytes behind each row
  std::uint32_t field = V4L2_FIELD_NONE;
  std::uint32_t colorspace = V4L2_COLORSPACE_SRGB, quantization = V4L2_QUANTIZATION_DEFAULT;
  v4l2_std_id standard = 0;
  std::map<std::uint32_t, double> fastest_hz;  ///< by four-character code; 25 where absent
  std::map<std::uint32_t, Control> controls;
  std::map<unsigned long, int> fails;  ///< errno of a request from now on
  std::uint32_t most_buffers = 32;

  // What the driver did.
  int opens = 0, streams_on = 0, mapped = 0;
  bool open = false, streaming = false;
  v4l2_pix_format format{};
  double rate_hz = 25;
  std::vector<std::uint32_t> set_controls;

  std::vector<std::vector<std::uint8_t>> memory;
  std::deque<std::uint32_t> queued;
  std::deque<v4l2_buffer> filled;
  std::uint32_t sequence = 0;

  std::size_t stride() const { return format.bytesperline; }
  std::size_t size() const { return format.sizeimage; }

  /// A picture whose rows are `rows[y % rows.size()]` is there, stamped now, if the driver left a buffer for it.
  void deliver(const std::vector<std::uint8_t>& picture, Delivery how) {
    const std::uint32_t count = sequence;
    if (how.field != V4L2_FIELD_TOP && how.field != V4L2_FIELD_BOTTOM) ++sequence;
    if (queued.empty() || !streaming) return;
    v4l2_buffer buffer{};
    buffer.index = queued.front();
    queued.pop_front();
    std::vector<std::uint8_t>& bytes = memory[buffer.index];
    std::fill(bytes.begin(), bytes.end(), std::uint8_t{0xcd});
    std::copy_n(picture.begin(), std::min(picture.size(), bytes.size()), bytes.begin());
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.bytesused = static_cast<std::uint32_t>(picture.size() - how.cut);
    buffer.flags = how.flags;
    buffer.field = how.field;
    buffer.sequence = count;
    buffer.timestamp.tv_sec = now.ns / 1'000'000'000;
    buffer.timestamp.tv_usec = now.ns % 1'000'000'000 / 1000;
    filled.push_back(buffer);
  }
  void deliver(std::uint8_t value) { deliver(std::vector<std::uint8_t>(size(), value), Delivery{}); }
  void deliver(std::uint8_t value, Delivery how) { deliver(std::vector<std::uint8_t>(size(), value), how); }

  void pass(Duration time) { now = now + time; }
  void unplug() { present = false; }
  void plug() { present = true; }
};

class ScriptedV4l2Device final : public V4l2Device {
 public:
  explicit ScriptedV4l2Device(std::shared_ptr<V4l2Script> script) : script_(std::move(script)) {}

  int open(const std::string&) noexcept override {
    ++my().opens;
    if (!my().present) return ENOENT;
    if (my().open_fails != 0) return my().open_fails;
    my().open = true;
    return 0;
  }
  void close() noexcept override {
    my().open = my().streaming = false;
    my().queued.clear();
    my().filled.clear();
    my().sequence = 0;
  }
  std::uint8_t* map(std::size_t, std::int64_t offset) noexcept override {
    ++my().mapped;
    return my().memory[static_cast<std::size_t>(offset)].data();
  }
  void unmap(std::uint8_t*, std::size_t) noexcept override { --my().mapped; }
  short wait(short, Duration) noexcept override {
    if (!my().present) return POLLERR | POLLHUP;
    if (my().fails.count(VIDIOC_DQBUF)) return POLLERR;
    return my().filled.empty() ? short{0} : short{POLLIN};
  }
  int write(const std::uint8_t*, std::size_t) noexcept override { return EINVAL; }
  Stamp now() const noexcept override { return script_->now; }

  int call(unsigned long request, void* argument) noexcept override {
    if (!my().open) return EBADF;
    if (!my().present) return ENODEV;
    if (const auto fault = my().fails.find(request); fault != my().fails.end()) return fault->second;
    switch (request) {
      case VIDIOC_QUERYCAP:
        return capability(*static_cast<v4l2_capability*>(argument));
      case VIDIOC_ENUM_FMT:
        return describe(*static_cast<v4l2_fmtdesc*>(argument));
      case VIDIOC_G_FMT:
        return get_format(*static_cast<v4l2_format*>(argument));
      case VIDIOC_S_FMT:
        return set_format(*static_cast<v4l2_format*>(argument));
      case VIDIOC_G_PARM:
      case VIDIOC_S_PARM:
        return rate(request, *static_cast<v4l2_streamparm*>(argument));
      case VIDIOC_G_STD:
        *static_cast<v4l2_std_id*>(argument) = my().standard;
        return my().standard ? 0 : ENOTTY;
      case VIDIOC_S_STD:
        return set_standard(*static_cast<v4l2_std_id*>(argument));
      case VIDIOC_S_INPUT:
        return *static_cast<int*>(argument) < 2 ? 0 : EINVAL;
      case VIDIOC_QUERYCTRL:
        return query(*static_cast<v4l2_queryctrl*>(argument));
      case VIDIOC_G_CTRL:
        return get(*static_cast<v4l2_control*>(argument));
      case VIDIOC_S_CTRL:
        return set(*static_cast<v4l2_control*>(argument));
      case VIDIOC_REQBUFS:
        return request_buffers(*static_cast<v4l2_requestbuffers*>(argument));
      case VIDIOC_QUERYBUF:
        return query_buffer(*static_cast<v4l2_buffer*>(argument));
      case VIDIOC_QBUF:
        my().queued.push_back(static_cast<v4l2_buffer*>(argument)->index);
        return 0;
      case VIDIOC_DQBUF:
        return dequeue(*static_cast<v4l2_buffer*>(argument));
      case VIDIOC_STREAMON:
        my().streaming = true;
        ++my().streams_on;
        my().sequence = 0;
        return 0;
      case VIDIOC_STREAMOFF:
        my().streaming = false;
        my().queued.clear();
        my().filled.clear();
        return 0;
      default:
        return ENOTTY;
    }
  }

 private:
  V4l2Script& my() { return *script_; }

  int capability(v4l2_capability& out) {
    out = {};
    std::strcpy(reinterpret_cast<char*>(out.card), "scripted");
    out.capabilities = my().capabilities | V4L2_CAP_DEVICE_CAPS;
    out.device_caps = my().capabilities;
    return 0;
  }
  int describe(v4l2_fmtdesc& out) {
    if (out.index >= my().offered.size()) return EINVAL;
    out.pixelformat = my().offered[out.index];
    return 0;
  }
  int get_format(v4l2_format& out) {
    out.fmt.pix = my().format;
    if (out.fmt.pix.width == 0) out.fmt.pix.width = my().width, out.fmt.pix.height = my().height;
    return 0;
  }
  int set_format(v4l2_format& out) {
    v4l2_pix_format& pix = out.fmt.pix;
    bool known = false;
    for (const std::uint32_t one : my().offered) known = known || one == pix.pixelformat;
    if (!known) pix.pixelformat = my().offered.front();
    pix.field = my().field;
    const bool half =
        my().field == V4L2_FIELD_ALTERNATE || my().field == V4L2_FIELD_TOP || my().field == V4L2_FIELD_BOTTOM;
    pix.width = my().width;
    pix.height = half ? my().height / 2 : my().height;
    const std::uint32_t bytes = pix.pixelformat == V4L2_PIX_FMT_GREY    ? 1
                                : pix.pixelformat == V4L2_PIX_FMT_BGR24 ? 3
                                                                        : 2;
    const bool compressed = pix.pixelformat == V4L2_PIX_FMT_MJPEG;
    pix.bytesperline = compressed ? 0 : pix.width * bytes + my().padding;
    pix.sizeimage = compressed ? pix.width * pix.height * 4 + 4096 : pix.bytesperline * pix.height;
    pix.colorspace = my().colorspace;
    pix.quantization = my().quantization;
    pix.ycbcr_enc = V4L2_YCBCR_ENC_DEFAULT;
    my().format = pix;
    return 0;
  }
  int rate(unsigned long request, v4l2_streamparm& out) {
    v4l2_captureparm& capture = out.parm.capture;
    if (request == VIDIOC_S_PARM) {
      const auto limit = my().fastest_hz.find(my().format.pixelformat);
      const double most = limit == my().fastest_hz.end() ? 25 : limit->second;
      my().rate_hz =
          std::min(most, static_cast<double>(capture.timeperframe.denominator) / capture.timeperframe.numerator);
    }
    capture = {};
    capture.capability = V4L2_CAP_TIMEPERFRAME;
    capture.timeperframe = {1000, static_cast<std::uint32_t>(my().rate_hz * 1000 + 0.5)};
    return 0;
  }
  int set_standard(v4l2_std_id wanted) {
    if (my().standard == 0) return ENOTTY;
    my().standard = wanted;
    return 0;
  }
  int query(v4l2_queryctrl& out) {
    const auto found = my().controls.upper_bound(out.id & ~static_cast<std::uint32_t>(V4L2_CTRL_FLAG_NEXT_CTRL));
    if (found == my().controls.end()) return EINVAL;
    out = {};
    out.id = found->first;
    out.type = found->second.type;
    out.minimum = found->second.minimum;
    out.maximum = found->second.maximum;
    found->second.name.copy(reinterpret_cast<char*>(out.name), sizeof out.name - 1);
    return 0;
  }
  int get(v4l2_control& out) {
    const auto found = my().controls.find(out.id);
    if (found == my().controls.end()) return EINVAL;
    out.value = found->second.value;
    return 0;
  }
  int set(const v4l2_control& in) {
    const auto found = my().controls.find(in.id);
    if (found == my().controls.end()) return EINVAL;
    if (found->second.refuses != 0) return found->second.refuses;
    found->second.value = in.value;
    my().set_controls.push_back(in.id);
    return 0;
  }
  int request_buffers(v4l2_requestbuffers& out) {
    out.count = std::min(out.count, my().most_buffers);
    my().memory.assign(out.count, std::vector<std::uint8_t>(my().size()));
    return 0;
  }
  int query_buffer(v4l2_buffer& out) {
    out.length = static_cast<std::uint32_t>(my().size());
    out.m.offset = out.index;
    return 0;
  }
  int dequeue(v4l2_buffer& out) {
    if (my().filled.empty()) return EAGAIN;
    out = my().filled.front();
    my().filled.pop_front();
    return 0;
  }

  std::shared_ptr<V4l2Script> script_;
};

}  // namespace tankrig
