#include "rig/commission/commission_sink.hpp"

#include <utility>

#include "session/recording/event_kinds.hpp"

namespace tankrig {

void CommissionSink::frame(const FrameRecord& record, const cv::Mat& image) {
  const auto found = witnesses.find(record.camera);
  if (found == witnesses.end()) return;
  BeamWitness& witness = found->second;
  const bool before = record.phase == Phase::kDarkBefore && !record.laser_on;
  if (before && witness.dark.count() < witness.to_learn) return witness.dark.add(image);
  if (!before && !(record.phase == Phase::kSweep && record.laser_on)) return;
  if ((before ? witness.clear + witness.stray : witness.seen) >= witness.enough) return;
  const auto sign = look_for_stripe(image, witness.dark.mean());
  const bool seen = sign && sign->present();
  if (before)
    ++(seen ? witness.stray : witness.clear);
  else
    ++(seen ? witness.seen : witness.missed);
}

void CommissionSink::event(Stamp when, std::string_view kind, const std::string& text) {
  if (kind == event_kind::kFault && !faulted) faulted = when;
  if (kind == event_kind::kStop && !faulted) faulted = when;
  if (kind != event_kind::kLaser) return;
  if (text == kLaserEmitting && !std::exchange(lit, true) && emits) emits();
  if (text == kLaserDark && lit) dark = when;
}

}  // namespace tankrig
