# find_package(tankrig): tankrig::pipeline and the libraries it stands on.
include(${CMAKE_CURRENT_LIST_DIR}/dependencies.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/tankrigTargets.cmake)
