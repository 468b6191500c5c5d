# What only simulated pictures stand on: markers, as OpenCV prints them.
if(NOT TARGET tankrig_opencv_aruco)
  find_library(OPENCV_aruco_LIBRARY opencv_aruco REQUIRED)
  add_library(tankrig_opencv_aruco UNKNOWN IMPORTED)
  set_target_properties(tankrig_opencv_aruco PROPERTIES IMPORTED_LOCATION "${OPENCV_aruco_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${OPENCV_INCLUDE_DIR}")
endif()
