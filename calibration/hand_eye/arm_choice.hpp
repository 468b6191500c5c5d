// Which numbers of the arm are refined with the camera's place: as many as views that were held back are the better for.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "calibration/hand_eye/marker_error.hpp"

namespace tankrig {

/// "shoulder zero", "elbow a"; index into HandEyeState::chain.
std::string chain_name(int number);

ArmModel with_added(const ArmModel& arm, const std::array<double, kDhNumbers>& chain);

std::vector<HandEyeView> selected(const std::vector<HandEyeView>& views, const std::vector<std::size_t>& which);

/// Fills in the solution's `choices` and `decision`; `state` stands at the choice's least squares afterwards.
///
/// The zeros of slew and jaw rotation, d of the first link and d, a, alpha of the last are not among the numbers: another place of
/// the camera or of the marker is the same. Shoulder and elbow turn about parallel axes, so one d stands for both.
ChainNumbers choose_arm(const HandEyeProblem& problem, const std::vector<std::size_t>& views, HandEyeState& state,
                        HandEyeSolution& solution);

}  // namespace tankrig
