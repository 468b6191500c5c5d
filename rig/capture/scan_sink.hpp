// Where a scan puts what it records: the session on disk, or a test's memory.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <string_view>

#include "drivers/arm/arm.hpp"
#include "session/reading/session.hpp"

namespace tankrig {

/// Threads: one, never the cycle's.
/// RT: never.
/// Errors: a sink that cannot record throws; the scan then ends safely.
class ScanSink {
 public:
  virtual ~ScanSink() = default;
  /// Every joint sample, in order of its stamp.
  virtual void joints(const JointState& state) = 0;
  /// A frame joined to its joints. The sink may choose `record.file`; the rest is filled in.
  virtual void frame(const FrameRecord& record, const cv::Mat& image) = 0;
  /// `kind`: one of event_kinds.hpp.
  virtual void event(Stamp when, std::string_view kind, const std::string& text) = 0;
};

}  // namespace tankrig
