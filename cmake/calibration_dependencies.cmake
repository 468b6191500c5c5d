# What calibration and simulated boards stand on besides cmake/dependencies.cmake: Ceres, OpenCV's markers and dots. ViSP has a file of its
# own, visp.cmake.
find_package(Ceres 2.1 REQUIRED)
import_modules(opencv "${OPENCV_INCLUDE_DIR}" aruco features2d)
