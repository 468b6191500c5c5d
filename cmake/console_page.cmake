# The console's page: TypeScript and three.js, bundled by npm where the 3D view of reports is (TANKRIG_CLOUD_VIEW), else a page that says what
# is missing. The sources are in console/web.

# tankrig_console_page(TARGET): defines site_file() in it.
function(tankrig_console_page target)
  set(from ${CMAKE_CURRENT_SOURCE_DIR}/web)
  set(page ${from}/index.html)
  set(platform_page ${from}/platform.html)
  set(style ${from}/console.css)
  set(login ${from}/login.html)
  if(TANKRIG_CLOUD_VIEW)
    set(script ${TANKRIG_WEB}/console/with_licence.js)
    set(platform_script ${TANKRIG_WEB}/console/platform.js)
    tankrig_licence(licences ${TANKRIG_WEB}/console/console.js three ${script})
    tankrig_bundle(console FROM ${from} PROGRAMS console platform OUTPUTS ${script} ${platform_script} LICENCES ${licences})
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
