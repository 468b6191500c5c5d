// How `calibrate all` records, and what it takes from a recording.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "apps/tankrig/scan/ready_rig.hpp"
#include "session/checking/open_session.hpp"

namespace tankrig::app {

/// A sweep over the rig's whole range and back, lit both ways. `rig` must outlive it.
ReadyRig::PlanFrom there_and_back(RigConfig& rig);

/// Frames of one camera that were recorded in the dark, by pass.
std::vector<std::vector<const FrameRecord*>> dark_frames_by_pass(const Session& session, const std::string& camera);

/// Their mean, 8 bits, in colour as it was recorded.
cv::Mat mean_picture(const Session& session, const std::vector<const FrameRecord*>& frames);
cv::Mat grey_of(const cv::Mat& picture);

}  // namespace tankrig::app
