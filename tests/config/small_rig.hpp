// A rig file with every section, for tests.
#pragma once

namespace tankrig {

inline constexpr const char* kSmallRig = R"(name: small
description: "a rig: for tests"
backend: mock
scene: scenes/tank.xml
arm:
  dh:
    - {a_m: 0.08052, alpha_rad: 1.5707963267948966, d_m: 0, theta0_rad: 0}
    - {a_m: 0.44278, alpha_rad: 0, d_m: 0, theta0_rad: 0.139277274}
    - {a_m: -0.083, alpha_rad: 1.5707963267948966, d_m: 0, theta0_rad: 1.972222055}
    - {a_m: 0, alpha_rad: 0, d_m: 0.54938, theta0_rad: 0}
  limits_rad:
    slew: [-1.5708, 0.5488]
    shoulder: [0, 1.58665]
    elbow: [0, 2.15294]
    jaw_rotate: [-3.14, 3.14]
    jaw_opening: [-0.05816, 1.337696]
  actuators:
    slew: {d_m: 0.32285, r_m: 0.05816, l_min_m: 0.26813, m_per_tick: 7.305e-06, alpha0_rad: 0.292535, q0_rad: -1.57, sign: 1}
    shoulder: {d_m: 0.07308, r_m: 0.537, l_min_m: 0.4675, m_per_tick: 4.31e-06, alpha0_rad: 0.292535, q0_rad: 0, sign: 1}
    elbow: {d_m: 0.48902, r_m: 0.05386, l_min_m: 0.437, m_per_tick: 5.495e-06, alpha0_rad: 0.2475, q0_rad: 2.15294, sign: -1}
    jaw_rotate: {rad_per_tick: 0.0031415927}
    jaw_opening: {rad_per_tick: 0.000537024}
  motion_limits: {angle_margin_rad: 0.01}
scan:
  park_rad: [0, 0.3, 1.9, 0, 0.1]
  posture_rad: [0, 0.12, 1.3, 0, 0.1]
  sweep: {from_rad: 1.3, to_rad: 2.1, velocity_rad_s: 0.1, passes: 1}
  dark_frames: 8
  control: {position_gain_per_s: 1.5}
presets:
  fine:
    sweep: {passes: 3, velocity_rad_s: 0.0625}
    read_lux: false
cameras:
  - name: mono
    role: mono
    model: {width_px: 720, height_px: 576, fx_px: 626.08, fy_px: 682.78, cx_px: 368.93, cy_px: 284.83, k1: -0.37, k2: 0.174}
    bMc: {translation_m: [0.1, 0.2, 0.3], quaternion_xyzw: [0.5, 0.5, 0.5, 0.5]}
    record: all
    rate_hz: 12.5
  - name: left
    role: left
    model: {width_px: 640, height_px: 480, fx_px: 765.4, fy_px: 762.9, cx_px: 315.7, cy_px: 236.8}
    bMc: {translation_m: [0, 0, 0], quaternion_xyzw: [0, 0, 0, 1]}
    record: dark
    rate_hz: 25
  - name: right
    role: right
    model: {width_px: 640, height_px: 480, fx_px: 776.4, fy_px: 771.0, cx_px: 328.9, cy_px: 219.9}
    bMc: {translation_m: [0.088, 0, 0], quaternion_xyzw: [0, 0, 0, 1]}
    record: dark
    rate_hz: 25
laser:
  ePl: {normal: [2, 0, 0], offset_m: 0.09796}
  origin_e_m: [-0.09796, 0, -0.188]
  direction_e: [0, 0, 1]
  fan_rad: 0.9
  warm_up_s: 2
object:
  mesh: objects/box.obj
  bMo: {translation_m: [0.5, 0, 1.09], quaternion_xyzw: [1, 0, 0, 0]}
obstacles:
  tank_size_m: [2, 2, 1.5]
  wMb: {translation_m: [0.55, 0, 1.25], quaternion_xyzw: [1, 0, 0, 0]}
  margin_m: 0.02
  link_radius_m: 0.045
  carried:
    - {from_e_m: [-0.1, 0, -0.3], to_e_m: [-0.1, 0, -0.19], radius_m: 0.03}
reconstruction:
  laser: {min_snr: 5, names: [a, "b: c"]}
evaluation: {inlier_m: 0.01}
)";

}  // namespace tankrig
