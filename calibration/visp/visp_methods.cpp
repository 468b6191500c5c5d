#include "calibration/visp/visp_methods.hpp"

#include "core/module.hpp"

namespace tankrig {

const VispMethods& visp() {
  static const auto& methods = *static_cast<const VispMethods*>(module_symbol("tankrig_visp.so", "tankrig_visp"));
  return methods;
}

}  // namespace tankrig
