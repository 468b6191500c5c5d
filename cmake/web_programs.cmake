# The programs of reports: clouds in 3D by three.js, curves by uPlot. TypeScript, bundled by npm when TANKRIG_CLOUD_VIEW is on, else left
# out. The sources are in bench/report/web, what npm fetches stays in the build folder.
option(TANKRIG_CLOUD_VIEW "Show a report's clouds in 3D and its curves with their values, and the console's page: needs npm, and its registry the first time" OFF)

# tankrig_web_programs(TARGET): defines what bench/report/web_programs.hpp declares.
function(tankrig_web_programs target)
  set(programs cloud_view plots)
  set(cloud_view_library three)
  set(plots_library uplot)
  set(from ${CMAKE_CURRENT_SOURCE_DIR}/report/web)
  set(web ${CMAKE_CURRENT_BINARY_DIR}/web)
  foreach(name ${programs})
    set(js ${web}/${name}_with_licence.js)
    list(APPEND bundles ${js})
    list(APPEND licences COMMAND ${CMAKE_COMMAND} -DWEB=${web} -DNAME=${name} -DLIBRARY=${${name}_library} -DOUT=${js}
      -P ${from}/with_licence.cmake)
    set(program ${CMAKE_CURRENT_BINARY_DIR}/${name}_program.cpp)
    if(TANKRIG_CLOUD_VIEW)
      configure_file(${from}/program.cpp.in ${program} @ONLY)
      set_source_files_properties(${program} PROPERTIES OBJECT_DEPENDS ${js} SKIP_UNITY_BUILD_INCLUSION ON)
    else()
      configure_file(${from}/no_program.cpp.in ${program} @ONLY)
    endif()
    target_sources(${target} PRIVATE ${program})
  endforeach()
  if(NOT TANKRIG_CLOUD_VIEW)
    return()
  endif()
  find_program(NPM npm REQUIRED)
  set(sources ${from}/package.json ${from}/package-lock.json ${from}/tsconfig.json ${from}/styles.d.ts)
  foreach(name ${programs})
    list(APPEND sources ${from}/${name}.ts)
  endforeach()
  add_custom_command(OUTPUT ${bundles} DEPENDS ${sources} ${from}/with_licence.cmake
    COMMAND ${CMAKE_COMMAND} -E make_directory ${web}
    COMMAND ${CMAKE_COMMAND} -E copy ${sources} ${web}
    COMMAND ${NPM} --prefix ${web} ci --ignore-scripts --no-audit --no-fund --loglevel=error
    COMMAND ${NPM} --prefix ${web} run --silent build
    ${licences}
    COMMENT "Bundling the programs of reports" VERBATIM)
endfunction()
