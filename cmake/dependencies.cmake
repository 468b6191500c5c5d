# Debian's packages that the libraries of an installed tankrig stand on, as imported targets. Also read by find_package(tankrig).
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)
find_package(TBB REQUIRED)
find_package(JPEG REQUIRED)
find_package(PNG REQUIRED)
find_package(OpenSSL REQUIRED COMPONENTS Crypto)
find_package(fmt REQUIRED)
find_package(mstch REQUIRED)
find_package(nlohmann_json REQUIRED)
pkg_check_modules(YAML_CPP REQUIRED IMPORTED_TARGET yaml-cpp)
pkg_check_modules(LIBDEFLATE REQUIRED IMPORTED_TARGET libdeflate)
pkg_check_modules(PUGIXML REQUIRED IMPORTED_TARGET pugixml)
find_package(embree 3 REQUIRED)
pkg_check_modules(ASSIMP REQUIRED IMPORTED_TARGET assimp)

# import_modules(FAMILY INCLUDE module...): FAMILY_module as tankrig_FAMILY_module.
function(import_modules family include)
  foreach(module ${ARGN})
    find_library(${family}_${module}_LIBRARY ${family}_${module} REQUIRED)
    if(NOT TARGET tankrig_${family}_${module})
      add_library(tankrig_${family}_${module} UNKNOWN IMPORTED GLOBAL)
      set_target_properties(tankrig_${family}_${module} PROPERTIES IMPORTED_LOCATION "${${family}_${module}_LIBRARY}"
        INTERFACE_INCLUDE_DIRECTORIES "${include}")
    endif()
  endforeach()
endfunction()

# OpenCVConfig.cmake finds every module and what each stands on, PCLConfig.cmake finds VTK and all that comes with it: find by hand
# those modules that we use, under names of our own, so that other programs can still find the whole of either.
find_path(OPENCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
import_modules(opencv "${OPENCV_INCLUDE_DIR}" core imgproc imgcodecs calib3d)
find_path(PCL_INCLUDE_DIR pcl/point_types.h PATH_SUFFIXES pcl-1.13 pcl-1.14 pcl-1.15 REQUIRED)
import_modules(pcl "${PCL_INCLUDE_DIR};${EIGEN3_INCLUDE_DIRS}" common search kdtree filters sample_consensus registration surface)
