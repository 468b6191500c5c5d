// The column `kind` of events.csv.
#pragma once

#include <string_view>

namespace tankrig {

namespace event_kind {
inline constexpr std::string_view kPlan = "plan";           ///< its stamp is time 0 of plan.csv
inline constexpr std::string_view kPhase = "phase";         ///< a segment of the plan begins
inline constexpr std::string_view kLaser = "laser";         ///< its command and its measured state
inline constexpr std::string_view kDrop = "drop";           ///< frames not recorded, and why
inline constexpr std::string_view kLeftOut = "left_out";    ///< an image that an import left out, and why
inline constexpr std::string_view kOverrun = "overrun";     ///< cycles missed
inline constexpr std::string_view kRealTime = "real_time";  ///< rights that the system refuses the cycle
inline constexpr std::string_view kInjected = "injected";   ///< a fault that was played
inline constexpr std::string_view kFault = "fault";         ///< what ended the scan, or left it unsafe
inline constexpr std::string_view kStop = "stop";           ///< on request
inline constexpr std::string_view kSummary = "summary";     ///< at the end
}  // namespace event_kind

/// Texts of kLaser that tell the measured state.
inline constexpr char kLaserEmitting[] = "emitting", kLaserDark[] = "dark";

}  // namespace tankrig
