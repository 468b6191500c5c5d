# The console's page: TypeScript and three.js, bundled by npm where the 3D view of reports is (TANKRIG_CLOUD_VIEW), else a page that says what
# is missing. The sources are in console/web, what npm fetches stays in the build folder.

# tankrig_console_page(TARGET): defines site_file() in it.
function(tankrig_console_page target)
  set(from ${CMAKE_CURRENT_SOURCE_DIR}/web)
  set(web ${CMAKE_CURRENT_BINARY_DIR}/web)
  set(page ${from}/index.html)
  set(platform_page ${from}/platform.html)
  set(style ${from}/console.css)
  set(login ${from}/login.html)
  if(TANKRIG_CLOUD_VIEW)
    find_program(NPM npm REQUIRED)
    set(script ${web}/with_licence.js)
    set(platform_script ${web}/platform.js)
    file(GLOB programs CONFIGURE_DEPENDS ${from}/*.ts)
    set(sources ${programs} ${from}/package.json ${from}/package-lock.json ${from}/tsconfig.json)
    add_custom_command(OUTPUT ${script} ${platform_script} DEPENDS ${sources} ${from}/with_licence.cmake
      COMMAND ${CMAKE_COMMAND} -E make_directory ${web}
      COMMAND ${CMAKE_COMMAND} -E copy ${sources} ${web}
      COMMAND ${NPM} --prefix ${web} ci --ignore-scripts --no-audit --no-fund --loglevel=error
      COMMAND ${NPM} --prefix ${web} run --silent build
      COMMAND ${CMAKE_COMMAND} -DWEB=${web} -DOUT=${script} -P ${from}/with_licence.cmake
      COMMENT "Bundling the console's page" VERBATIM)
  else()
    set(page ${from}/without_npm.html)
    set(platform_page ${page})
    set(script ${style})  # that page asks for neither
    set(platform_script ${style})
  endif()
  configure_file(web/site.cpp.in site.cpp @ONLY)
  target_sources(${target} PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/site.cpp)
  set_source_files_properties(${CMAKE_CURRENT_BINARY_DIR}/site.cpp PROPERTIES OBJECT_DEPENDS "${page};${style};${script};${platform_page};${platform_script};${login}")
endfunction()
