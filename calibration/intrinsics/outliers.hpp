// Pictures and corners that do not fit the others.
#pragma once

#include "calibration/intrinsics/board_bundle.hpp"

namespace tankrig {

/// Fits all views with a loss that bears outliers, then takes out of `bundle` the views that do not fit (most of their
/// corners lie four times farther off than usual), and single corners far off. Returns the corners; `view` counts the
/// views as they were before.
/// Errors: InputError naming the views, if more than a third of them does not fit: they are not of one camera, or not
/// of this target.
std::vector<CornerResidual> leave_out_what_does_not_fit(BoardBundle& bundle);

}  // namespace tankrig
