// What a plan means on its rig, before anything moves: is it safe, and how much will be recorded.
#pragma once

#include <cstdint>
#include <filesystem>

#include "rig/config/rig_config.hpp"
#include "rig/plan/motion_check.hpp"
#include "rig/plan/scan_plan.hpp"

namespace tankrig::app {

/// What the arm must keep away from: the rig's obstacles, cameras and object.
/// Errors: InputError of the mesh.
Obstacles obstacles_of(const RigConfig& rig);

/// The plan against the rig file's limits, object, floor, walls, cameras and frame, and the arm against itself.
/// Errors: InputError if it is not safe.
MotionCheck check_plan(const RigConfig& rig, const ScanPlan& plan);

/// How many frames a camera will record, at the times or the angles it is set to.
int expected_frames(const RigConfig& rig, const RigCamera& camera, const ScanPlan& plan);

/// Bytes that the session takes on its disk at most, with what is made of it.
std::uint64_t disk_need(const RigConfig& rig, const ScanPlan& plan);

/// Errors: InputError with need, rest and cure if there is no room for the session at `path`.
void check_room(const RigConfig& rig, const ScanPlan& plan, const std::filesystem::path& path);

/// The rig's scan from `posture`.
/// Errors: InputError if its light is not as the rig file allows, or would not be verified.
ScanPlan sweep_plan(const RigConfig& rig, const JointVector& posture);

}  // namespace tankrig::app
