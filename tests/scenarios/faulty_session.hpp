// The session of a rig with a fault plan, and the loop that fills it: both as the plan spoils them.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "rig/capture/scan_sink.hpp"
#include "session/recording/session_writer.hpp"
#include "sim_backends/faults/faulty_host.hpp"
#include "tests/scenarios/small_rig.hpp"

namespace tankrig::scenarios {

/// Where disk or loop fail, the tape says when.  All that it is given outlives it.
class FaultySession final : public ScanSink {
 public:
  FaultySession(SessionWriter& writer, sim::FaultScript& script, Clock& clock, CallTape& tape, Outcome& outcome)
      : writer_(writer), script_(script), host_(script, clock), tape_(tape), outcome_(outcome) {}

  void joints(const JointState& state) override {
    taped([&] { host_.write(false); });
    writer_.joints(state);
  }
  void frame(const FrameRecord& record, const cv::Mat& image) override {
    taped([&] { host_.write(true); });
    if (look) look(record, image);
    writer_.frame(record, image);
  }
  void event(Stamp when, std::string_view kind, const std::string& text) override {
    if (kind == "phase") script_.enter_phase(text, when);
    outcome_.events.push_back({when, std::string(kind), text});
    writer_.event(when, kind, text);
  }

  std::function<void(const FrameRecord&, const cv::Mat&)> look;  ///< what is recorded; may be empty

  /// Once in every round of the loop.
  void round() {
    taped([&] { host_.round(); });
  }
  /// The loop of the interlock where it really is closed.
  bool interlock() const { return host_.interlock(true); }

 private:
  template <class Work>
  void taped(Work work) {
    try {
      work();
    } catch (...) {
      tape_.add(Call::kScan, true);
      throw;
    }
  }

  SessionWriter& writer_;
  sim::FaultScript& script_;
  sim::FaultyHost host_;
  CallTape& tape_;
  Outcome& outcome_;
};

}  // namespace tankrig::scenarios
