// Frames and transforms, in the paper's and ViSP's notation.
//
// aMb maps b-coordinates to a:  pa = aMb * pb.  Inner letters cancel:  cMl = cMb * bMe * lMe^-1.
//
//   w  tank          origin at the centre of the floor, x and y along the walls, z up. Fixed.
//   b  arm base      `kinematic_base`: on the slew axis; x forward at slew 0, z down. Fixed while the frame is bolted.
//   e  end effector  end of the DH chain: z along the forearm (the tool axis), y along b's y at slew 0 and roll 0.
//                    Moves with q.
//   c  camera        pinhole centre of the reference camera (mono, or left); z into the scene, x right, y down. Fixed.
//   r  right camera  the other eye of the stereo pair. Fixed.
//   l  laser         origin at the projector's exit; the sheet is the plane x = 0, the light travels along +z. Moves with e.
//   o  object        the mesh file's own frame; our box has it at the centre of its top face, z up. Fixed.
//   g  gripper       marker on the gripper. Moves with e.
//
// All right-handed, metres. A laser is *stored* as a plane (unit normal, offset) rigid with e: only three of the
// six freedoms of lMe are observable, the rest of lMe is a chosen gauge.
#pragma once

#include <Eigen/Geometry>

namespace tankrig {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Transform = Eigen::Isometry3d;

/// Points p with normal . p + offset = 0; unit normal, metres.
struct Plane {
  Vector3d normal = Vector3d::UnitZ();
  double offset = 0.0;

  /// Signed distance of p from the plane, positive on the normal's side.
  double distance(const Vector3d& p) const { return normal.dot(p) + offset; }
};

/// The plane `plane_b`, given in b, expressed in a.
Plane operator*(const Transform& aMb, const Plane& plane_b);

/// Translation [m] and unit quaternion (x, y, z, w).
/// Errors: InputError if the quaternion's norm is not 1 within 1e-3.
Transform make_transform(const Vector3d& translation, const Eigen::Vector4d& quaternion_xyzw);

/// Translation [m] and fixed-axis roll, pitch, yaw [rad]: R = Rz(yaw) * Ry(pitch) * Rx(roll).
Transform make_transform_rpy(const Vector3d& translation, const Vector3d& roll_pitch_yaw);

/// (x, y, z, w) of aMb's rotation, w >= 0.
Eigen::Vector4d quaternion_xyzw(const Transform& aMb);

/// aMb as a session stores it, by make_transform() of translation and quaternion_xyzw(): its last bits may differ.
Transform as_stored(const Transform& aMb);

}  // namespace tankrig
