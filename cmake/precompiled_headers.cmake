# Headers that most files read, parsed once for each way of compiling. A file includes what it needs all the same: with
# -DTANKRIG_UNITY=OFF it is compiled by itself, without them.
set(TANKRIG_PRECOMPILE OFF)
if(TANKRIG_UNITY AND NOT TANKRIG_FUZZ AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  set(TANKRIG_PRECOMPILE ON)
  add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-fpch-preprocess>)  # so that ccache knows what is in them
  add_compile_options(-pthread)  # one way of compiling: some libraries ask for it
endif()
set(common_headers <algorithm> <array> <chrono> <cmath> <filesystem> <functional> <map> <memory> <optional> <string> <variant> <vector>
  <Eigen/Dense> <fmt/format.h> <opencv2/core.hpp>)

# tankrig_precompile(TARGET OF HEADER...): the common headers and these for TARGET; without any, those that were made for OF, whose
# options are the same.
function(tankrig_precompile target of)
  if(NOT TANKRIG_PRECOMPILE)
    return()
  elseif(target STREQUAL of)
    target_precompile_headers(${target} PRIVATE ${common_headers} ${ARGN})
  else()
    target_precompile_headers(${target} REUSE_FROM ${of})
  endif()
endfunction()

# tankrig_vectorise(FILE...): compiled with -O3, for loops that are written to be vectorised; a square root sets no errno, and so is one
# instruction. Precompiled headers would bring back the -O that they were made with.
function(tankrig_vectorise)
  set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS "-O3;-fno-math-errno" SKIP_PRECOMPILE_HEADERS ON)
endfunction()
