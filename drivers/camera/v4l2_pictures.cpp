#include "drivers/camera/v4l2_pictures.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <utility>

namespace tankrig {
namespace {

// A stamp outside of these is on no clock of ours. Ahead: vivid stamps the end of a frame before that has come.
constexpr Duration kOldest = std::chrono::minutes{1}, kAhead = std::chrono::seconds{1};

bool has_two_fields(FieldLayout layout) { return layout != FieldLayout::kProgressive && !is_lone_field(layout); }

}  // namespace

V4l2Pictures::V4l2Pictures(const V4l2CameraSettings& settings, const V4l2Format& format,
                           std::optional<Duration> exposure)
    : settings_(settings),
      format_(format),
      frame_period_(format.rate_hz > 0 ? from_seconds(1 / format.rate_hz) : Duration{0}),
      alternating_(format.field == V4L2_FIELD_ALTERNATE),
      two_fields_(has_two_fields(field_layout(format.field, format.top_first))),
      both_fields_(settings.fields == FieldUse::kBoth && (alternating_ || two_fields_)) {
  exposure_.time = exposure;
  exposure_.readout = settings.readout;
  exposure_.rolling_shutter = settings.rolling_shutter;
  exposure_.period = alternating_ || two_fields_ ? frame_period_ / 2 : frame_period_;
  exposure_.stamp_sigma = settings.stamp_sigma;
}

MidExposure V4l2Pictures::mid_of(const v4l2_buffer& buffer, Stamp last_empty, Stamp now) {
  V4l2BufferTimes times;
  times.stamp = {static_cast<std::int64_t>(buffer.timestamp.tv_sec) * 1'000'000'000 +
                 static_cast<std::int64_t>(buffer.timestamp.tv_usec) * 1000};
  const bool declared = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  times.monotonic =
      settings_.stamp_clock == StampClock::kMonotonic || (settings_.stamp_clock == StampClock::kDeclared && declared);
  if (times.stamp < now - kOldest || times.stamp > now + kAhead) times.monotonic = false;
  times.at_start = settings_.stamp_point == StampPoint::kStart ||
                   (settings_.stamp_point == StampPoint::kDeclared &&
                    (buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE);
  times.arrived_after = last_empty;
  times.arrived_before = now;
  monotonic_ = times.monotonic;
  counts_.at_start = times.monotonic && times.at_start;
  ++(times.monotonic ? counts_.monotonic_stamps : counts_.arrival_stamps);
  return mid_exposure(times, exposure_);
}

V4l2Taken V4l2Pictures::add(const v4l2_buffer& buffer, std::span<const std::uint8_t> memory, Stamp last_empty,
                            Stamp now) {
  const std::uint32_t field = alternating_ ? buffer.field : format_.field;
  const FieldLayout layout = field_layout(field, format_.top_first);
  const bool newer_field = alternating_ && first_field(layout) != (format_.top_first ? Parity::kTop : Parity::kBottom);
  // One field of each pair is wanted: the other is no news, whatever its state.
  if (alternating_ && settings_.fields == (newer_field ? FieldUse::kFirst : FieldUse::kSecond)) return {};

  V4l2Taken taken;
  const MidExposure mid = mid_of(buffer, last_empty, now);
  const bool each_field_counts = alternating_ && settings_.fields == FieldUse::kBoth;
  const bool partner =
      alternating_ && settings_.fields == FieldUse::kWeave && newer_field && (waiting_ || broken_ == last_number_);
  // Times of arrival are too coarse to tell a missing picture by.
  const Duration countable = monotonic_ ? frame_period_ : Duration{0};
  V4l2Sequence::Place place;
  if (each_field_counts)
    place = sequence_.place(2 * buffer.sequence + (newer_field ? 1u : 0u), mid.stamp, countable / 2);
  else if (partner && buffer.sequence == last_device_number_)
    place.number = last_number_;
  else
    place = sequence_.place(buffer.sequence, mid.stamp, countable);
  last_device_number_ = buffer.sequence;
  last_number_ = place.number;
  if (waiting_ && waiting_->number != place.number) drop_waiting();  // its partner never came
  const std::uint64_t per_buffer = both_fields_ && two_fields_ ? 2 : 1;
  taken.missed = place.missed * per_buffer;

  if (buffer.flags & V4L2_BUF_FLAG_ERROR) {
    ++counts_.error_buffers;
    break_frame(place.number, per_buffer);
    return told(taken);
  }
  const std::size_t used = std::min<std::size_t>(buffer.bytesused, memory.size());
  auto picture =
      to_image({format_.pixel, format_.width, format_.height, format_.stride, memory.first(used), format_.full_range},
               settings_.channels);
  if (!picture.ok()) {
    ++counts_.damaged_pictures;
    break_frame(place.number, per_buffer);
    return told(taken);
  }
  if (is_lone_field(layout))
    add_lone_field(picture.value(), first_field(layout), mid, place.number);
  else if (has_two_fields(layout))
    add_two_fields(picture.value(), layout, mid, place.number);
  else
    push(std::move(picture.value()), mid, place.number);
  return told(taken);
}

V4l2Taken V4l2Pictures::told(V4l2Taken taken) {
  taken.incomplete = std::exchange(incomplete_, 0);
  return taken;
}

/// Once, however many of its fields are damaged or missing.
void V4l2Pictures::break_frame(std::uint64_t number, std::uint64_t frames) {
  if (std::exchange(broken_, number) != number) incomplete_ += frames;
  if (waiting_ && waiting_->number == number) drop_waiting();
}

void V4l2Pictures::drop_waiting() {
  if (!waiting_) return;
  const std::uint64_t number = waiting_->number;
  waiting_.reset();
  ++counts_.unpaired_fields;
  break_frame(number);
}

void V4l2Pictures::add_two_fields(const cv::Mat& picture, FieldLayout layout, const MidExposure& mid,
                                  std::uint64_t number) {
  const Parity older = first_field(layout), newer = other(older);
  const auto push_field = [&](Parity parity, std::uint64_t its_number) {
    push(full_height(field_lines(picture, layout, parity), parity),
         field_mid_exposure(mid, parity == older, counts_.at_start, frame_period_), its_number);
  };
  switch (settings_.fields) {
    case FieldUse::kFirst:
      return push_field(older, number);
    case FieldUse::kSecond:
      return push_field(newer, number);
    case FieldUse::kBoth:
      push_field(older, 2 * number);
      return push_field(newer, 2 * number + 1);
    case FieldUse::kWeave:
      break;
  }
  const bool in_place = layout == FieldLayout::kInterlacedTopFirst || layout == FieldLayout::kInterlacedBottomFirst;
  push(in_place ? picture
                : woven(field_lines(picture, layout, Parity::kTop), field_lines(picture, layout, Parity::kBottom)),
       woven_mid_exposure(mid, counts_.at_start, frame_period_), number);
}

void V4l2Pictures::add_lone_field(const cv::Mat& lines, Parity parity, const MidExposure& mid, std::uint64_t number) {
  if (!alternating_ || settings_.fields != FieldUse::kWeave) return push(full_height(lines, parity), mid, number);
  if (waiting_ && waiting_->number == number && waiting_->parity != parity) {
    const cv::Mat top = parity == Parity::kTop ? lines : waiting_->lines;
    const cv::Mat bottom = parity == Parity::kTop ? waiting_->lines : lines;
    // Half way between the two fields' own stamps.
    MidExposure between = woven_mid_exposure(mid, false, frame_period_);
    between.stamp = waiting_->mid.stamp + (mid.stamp - waiting_->mid.stamp) / 2;
    waiting_.reset();
    return push(woven(top, bottom), between, number);
  }
  if (broken_ != number) waiting_ = WaitingField{lines, parity, mid, number};
}

void V4l2Pictures::push(cv::Mat image, const MidExposure& mid, std::uint64_t number) {
  Frame frame{std::move(image), mid.stamp, mid.sigma, mid.exposure, number};
  (ready_[0] ? ready_[1] : ready_[0]) = std::move(frame);
}

std::optional<Frame> V4l2Pictures::pop() {
  std::optional<Frame> frame = std::move(ready_[0]);
  ready_[0] = std::move(ready_[1]);
  ready_[1].reset();
  return frame;
}

void V4l2Pictures::restart() {
  sequence_.restart();
  drop_waiting();
}

void V4l2Pictures::begin_anew() {
  sequence_.begin_anew();
  drop_waiting();
}

void V4l2Pictures::forget() {
  drop_waiting();
  ready_ = {};
}

}  // namespace tankrig
