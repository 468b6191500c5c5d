# ViSP as the imported target visp_core. VISPConfig.cmake (libvisp-dev only) would set the caller's C++ standard and flags: find the
# module by hand.
#
# ViSP 3.5 names constructors `vpArray2D<Type>(`, which C++20 has taken out of the language (P1787, [class.ctor]). A copy of that one
# header without the `<Type>` stands before the system's.
find_path(VISP_INCLUDE_DIR visp3/core/vpArray2D.h REQUIRED)
find_library(VISP_core_LIBRARY visp_core REQUIRED)
set(visp_cure ${PROJECT_BINARY_DIR}/visp)
file(READ ${VISP_INCLUDE_DIR}/visp3/core/vpArray2D.h header)
string(REPLACE "vpArray2D<Type>(" "vpArray2D(" header "${header}")
file(CONFIGURE OUTPUT ${visp_cure}/visp3/core/vpArray2D.h CONTENT "${header}" @ONLY)
add_library(visp_core UNKNOWN IMPORTED)
set_target_properties(visp_core PROPERTIES IMPORTED_LOCATION "${VISP_core_LIBRARY}"
  INTERFACE_INCLUDE_DIRECTORIES "${visp_cure};${VISP_INCLUDE_DIR}")
