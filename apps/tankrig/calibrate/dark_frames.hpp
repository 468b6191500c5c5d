// What a camera saw in a recording while no light was on.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "session/reading/session.hpp"

namespace tankrig::app {

/// Frames of one camera that were recorded in the dark, by pass.
std::vector<std::vector<const FrameRecord*>> dark_frames_by_pass(const Session& session, const std::string& camera);

/// Their mean, 8 bits, in colour as it was recorded.
cv::Mat mean_picture(const Session& session, const std::vector<const FrameRecord*>& frames);
cv::Mat grey_of(const cv::Mat& picture);

/// The mean picture of a camera while the arm rests and no light is on.
/// Errors: InputError if there is none.
cv::Mat dark_picture(const Session& session, const std::string& camera);

}  // namespace tankrig::app
