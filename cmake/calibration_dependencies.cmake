# What calibration stands on besides cmake/dependencies.cmake, as imported targets: Ceres, and OpenCV's markers and dots. ViSP has a file of its
# own, visp.cmake.
find_package(Ceres 2.1 REQUIRED)
foreach(module aruco features2d)
  find_library(OPENCV_${module}_LIBRARY opencv_${module} REQUIRED)
  if(NOT TARGET tankrig_opencv_${module})
    add_library(tankrig_opencv_${module} UNKNOWN IMPORTED)
    set_target_properties(tankrig_opencv_${module} PROPERTIES IMPORTED_LOCATION "${OPENCV_${module}_LIBRARY}"
      INTERFACE_INCLUDE_DIRECTORIES "${OPENCV_INCLUDE_DIR}")
  endif()
endforeach()
