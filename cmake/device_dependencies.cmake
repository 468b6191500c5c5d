# Debian's packages that devices, their emulators and the program stand on, as imported targets.
find_package(spdlog REQUIRED)
find_package(CLI11 REQUIRED)
pkg_check_modules(ARAVIS REQUIRED IMPORTED_TARGET aravis-0.8)
pkg_check_modules(GIO REQUIRED IMPORTED_TARGET gio-2.0)
pkg_check_modules(MUPARSER REQUIRED IMPORTED_TARGET muparser)
pkg_check_modules(LIBSERIAL REQUIRED IMPORTED_TARGET libserial)
find_path(NANOFLANN_INCLUDE_DIR nanoflann.hpp REQUIRED)
find_package(fcl REQUIRED CONFIG)
