// The recordings of `calibrate all`: one session a step, kept, so that a calibration can go on where it was stopped.
#pragma once

#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/scan/ready_rig.hpp"
#include "session/checking/open_session.hpp"

namespace tankrig::app {

/// The session at `path`: as it is if it is complete, else recorded now, after `before()`, without clouds and report. One
/// that was stopped is put aside.
/// Errors: InputError, also if the recording is stopped or frames of it are missing; StoppedEarly.
OpenedSession recorded_step(const ScanOptions& options, const RigConfig& rig, const std::filesystem::path& path,
                            const ReadyRig::PlanFrom& plan_from, Progress& progress,
                            const std::function<void()>& before);

/// A sweep over the rig's whole range and back, lit both ways. `rig` must outlive it.
ReadyRig::PlanFrom there_and_back(RigConfig& rig);

/// Frames of one camera that were recorded in the dark, by pass.
std::vector<std::vector<const FrameRecord*>> dark_frames_by_pass(const Session& session, const std::string& camera);

/// Their mean, 8 bits, in colour as it was recorded.
cv::Mat mean_picture(const Session& session, const std::vector<const FrameRecord*>& frames);
cv::Mat grey_of(const cv::Mat& picture);

}  // namespace tankrig::app
