// Our transforms as ViSP's, and back.
#pragma once

#include <visp3/core/vpHomogeneousMatrix.h>

#include "core/frames.hpp"

namespace tankrig {

/// ViSP's aMb means what ours does: pa = aMb * pb, metres.
vpHomogeneousMatrix to_visp(const Transform& aMb);

/// The rotation comes back orthonormal though ViSP's has lost a little of that in its sums.
/// Errors: InputError if it is no rotation within 1e-3.
Transform from_visp(const vpHomogeneousMatrix& aMb);

}  // namespace tankrig
