// The simplest lens model that fits: by pictures that it was not fitted to.
#pragma once

#include "calibration/intrinsics/intrinsics.hpp"

namespace tankrig {

struct ModelChoice {
  BoardBundle bundle;  ///< solved
  std::vector<CornerResidual> residuals;
  std::vector<TriedModel> tried;
  std::string decision;
};

/// `bundle` has one camera, and a first guess. A model is fitted to four fifths of the pictures, and the others' corners
/// are measured against it, five times over. The simplest is taken whose mean square there is above the best one's by
/// no more than two standard errors of this difference over the pictures. A rational one is tried too, but only for the
/// figure: the rig's camera model does not hold it. Then a bent target is tried likewise.
ModelChoice choose_model(const BoardBundle& bundle, std::optional<LensModel> lens, std::optional<bool> bends);

/// `pinhole`, or the same pictures through a flat port where that fits better by the same rule. `behind`: a first guess with a
/// port; its lens is held, or the simplest that fits behind it is found.
/// Errors: InputError if there are too few pictures to hold any back.
ModelChoice choose_port(ModelChoice pinhole, const BoardBundle& behind, std::optional<LensModel> lens);

}  // namespace tankrig
