# Debian's packages that the libraries of an installed tankrig stand on, as imported targets. Also read by find_package(tankrig).
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)
find_package(TBB REQUIRED)
find_package(JPEG REQUIRED)
find_package(OpenSSL REQUIRED COMPONENTS Crypto)
find_package(fmt REQUIRED)
find_package(mstch REQUIRED)
find_package(nlohmann_json REQUIRED)
pkg_check_modules(YAML_CPP REQUIRED IMPORTED_TARGET yaml-cpp)
pkg_check_modules(LIBDEFLATE REQUIRED IMPORTED_TARGET libdeflate)
pkg_check_modules(PUGIXML REQUIRED IMPORTED_TARGET pugixml)
find_package(embree 3 REQUIRED)
pkg_check_modules(ASSIMP REQUIRED IMPORTED_TARGET assimp)

# OpenCVConfig.cmake finds every module and what each stands on: find by hand those we use, under names
# of our own, so that other programs can still find the whole of it.
find_path(OPENCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
foreach(module core imgproc imgcodecs calib3d)
  find_library(OPENCV_${module}_LIBRARY opencv_${module} REQUIRED)
  if(NOT TARGET tankrig_opencv_${module})
    add_library(tankrig_opencv_${module} UNKNOWN IMPORTED)
    set_target_properties(tankrig_opencv_${module} PROPERTIES IMPORTED_LOCATION "${OPENCV_${module}_LIBRARY}"
      INTERFACE_INCLUDE_DIRECTORIES "${OPENCV_INCLUDE_DIR}")
  endif()
endforeach()

# PCLConfig.cmake finds VTK and all that comes with it: find the modules by hand.
find_path(PCL_INCLUDE_DIR pcl/point_types.h PATH_SUFFIXES pcl-1.13 pcl-1.14 pcl-1.15 REQUIRED)
foreach(module common search kdtree filters features sample_consensus segmentation registration surface)
  find_library(PCL_${module}_LIBRARY pcl_${module} REQUIRED)
  if(NOT TARGET tankrig_pcl_${module})
    add_library(tankrig_pcl_${module} UNKNOWN IMPORTED)
    set_target_properties(tankrig_pcl_${module} PROPERTIES IMPORTED_LOCATION "${PCL_${module}_LIBRARY}"
      INTERFACE_INCLUDE_DIRECTORIES "${PCL_INCLUDE_DIR}" INTERFACE_LINK_LIBRARIES Eigen3::Eigen)
  endif()
endforeach()
