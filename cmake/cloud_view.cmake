# The 3D view of a report's clouds: TypeScript and three.js, bundled by npm when TANKRIG_CLOUD_VIEW is on, else left out. The sources are in
# bench/report/web, what npm fetches stays in the build folder.
option(TANKRIG_CLOUD_VIEW "Show a report's clouds in 3D: needs npm, and its registry the first time" OFF)

# tankrig_cloud_view(TARGET): defines cloud_view_program() in it.
function(tankrig_cloud_view target)
  if(NOT TANKRIG_CLOUD_VIEW)
    file(CONFIGURE OUTPUT no_cloud_view.cpp CONTENT [[
#include "bench/report/cloud_view.hpp"
const std::string& tankrig::cloud_view_program() {
  static const std::string none;
  return none;
}
]] @ONLY)
    target_sources(${target} PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/no_cloud_view.cpp)
    return()
  endif()
  find_program(NPM npm REQUIRED)
  set(from ${CMAKE_CURRENT_SOURCE_DIR}/report/web)
  set(web ${CMAKE_CURRENT_BINARY_DIR}/web)
  set(js ${web}/with_licence.js)
  set(sources ${from}/cloud_view.ts ${from}/package.json ${from}/package-lock.json ${from}/tsconfig.json)
  add_custom_command(OUTPUT ${js} DEPENDS ${sources} ${from}/with_licence.cmake
    COMMAND ${CMAKE_COMMAND} -E make_directory ${web}
    COMMAND ${CMAKE_COMMAND} -E copy ${sources} ${web}
    COMMAND ${NPM} --prefix ${web} ci --ignore-scripts --no-audit --no-fund --loglevel=error
    COMMAND ${NPM} --prefix ${web} run --silent build
    COMMAND ${CMAKE_COMMAND} -DWEB=${web} -DOUT=${js} -P ${from}/with_licence.cmake
    COMMENT "Bundling the 3D view of reports" VERBATIM)
  configure_file(report/web/cloud_view_program.cpp.in cloud_view_program.cpp @ONLY)
  set(program ${CMAKE_CURRENT_BINARY_DIR}/cloud_view_program.cpp)
  target_sources(${target} PRIVATE ${program})
  set_source_files_properties(${program} PROPERTIES OBJECT_DEPENDS ${js} SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()
