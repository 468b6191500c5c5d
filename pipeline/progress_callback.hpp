// How long work tells of itself.
#pragma once

#include <functional>
#include <string>

namespace tankrig {

/// `fraction` of `stage` is done, in [0, 1]. May be called from any thread; empty: nobody wants to know.
using ProgressCallback = std::function<void(const std::string& stage, double fraction)>;

}  // namespace tankrig
