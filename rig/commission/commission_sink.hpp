// What one run of the start-up test tells: its fault, the laser's state, and what each camera sees of the beam.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>

#include "rig/capture/scan_sink.hpp"
#include "rig/safety/beam_check.hpp"

namespace tankrig {

/// Of one camera, its first pictures taken for the dark. Those after enough are not looked at: the supervisor has no time
/// to spare.
struct BeamWitness {
  int to_learn = 0, enough = 0;
  DarkReference dark{};
  int clear = 0, stray = 0;  ///< dark pictures after those, without and with a stripe
  int seen = 0, missed = 0;  ///< lit pictures
};

/// Threads: one.
class CommissionSink final : public ScanSink {
 public:
  std::map<std::string, BeamWitness> witnesses;  ///< by camera
  std::function<void()> emits;                   ///< once, when the laser first shines
  std::optional<Stamp> faulted, dark;            ///< the first fault; when the laser's contact was then read open
  std::optional<JointVector> joints_now;
  bool lit = false;

  /// Every witness has seen the beam in enough pictures.
  bool beam_seen() const {
    for (const auto& [camera, witness] : witnesses)
      if (witness.seen < witness.enough) return false;
    return true;
  }

  void joints(const JointState& state) override { joints_now = state.q; }
  void frame(const FrameRecord& record, const cv::Mat& image) override;
  void event(Stamp when, std::string_view kind, const std::string& text) override;
};

}  // namespace tankrig
