# ViSP's modules as imported targets: visp_core, visp_vision and others. VISPConfig.cmake (libvisp-dev only) would set the caller's
# C++ standard and flags: find the modules by hand.
#
# ViSP 3.5 names constructors `vpArray2D<Type>(`, which C++20 has taken out of the language (P1787, [class.ctor]). A copy of that one
# header without the `<Type>` stands before the system's.
find_path(VISP_INCLUDE_DIR visp3/core/vpArray2D.h REQUIRED)
set(visp_cure ${PROJECT_BINARY_DIR}/visp)
file(READ ${VISP_INCLUDE_DIR}/visp3/core/vpArray2D.h header)
string(REPLACE "vpArray2D<Type>(" "vpArray2D(" header "${header}")
file(CONFIGURE OUTPUT ${visp_cure}/visp3/core/vpArray2D.h CONTENT "${header}" @ONLY)
foreach(module core vision detection blob)
  find_library(VISP_${module}_LIBRARY visp_${module} REQUIRED)
  add_library(visp_${module} UNKNOWN IMPORTED)
  set_target_properties(visp_${module} PROPERTIES IMPORTED_LOCATION "${VISP_${module}_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${visp_cure};${VISP_INCLUDE_DIR}")
endforeach()
