// A session in memory.
#pragma once

#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "rig/capture/scan_sink.hpp"

namespace tankrig::testing_support {

class RecordingSink final : public ScanSink {
 public:
  void joints(const JointState& state) override { states.push_back(state); }
  void frame(const FrameRecord& record, const cv::Mat& image) override {
    if (static_cast<int>(frames.size()) == throw_at) throw std::runtime_error("disk full");
    if (on_frame) on_frame(record);
    frames.push_back(record);
    pixels.push_back(image.at<unsigned char>(0, 0));
  }
  void event(Stamp when, std::string_view kind, const std::string& text) override {
    if (on_event) on_event(kind, text);
    events.push_back({when, std::string(kind), text});
  }

  struct Event {
    Stamp when;
    std::string kind, text;
  };
  std::vector<JointState> states;
  std::vector<FrameRecord> frames;
  std::vector<int> pixels;
  std::vector<Event> events;
  int throw_at = -1;
  std::function<void(const FrameRecord&)> on_frame;
  std::function<void(std::string_view kind, const std::string& text)> on_event;

  /// Is there an event of this kind whose text has `words` in it?
  bool told(const std::string& kind, const std::string& words) const {
    for (const Event& e : events)
      if (e.kind == kind && e.text.find(words) != std::string::npos) return true;
    return false;
  }

  /// Frames of a camera in a phase.
  std::vector<FrameRecord> of(const std::string& camera, Phase phase) const {
    std::vector<FrameRecord> result;
    for (const FrameRecord& f : frames)
      if (f.camera == camera && f.phase == phase) result.push_back(f);
    return result;
  }
};

}  // namespace tankrig::testing_support
