# What npm fetches, once for all pages, and how TypeScript becomes a bundle. Nothing of it is in the sources: it lies in web of the build folder.
option(TANKRIG_CLOUD_VIEW "Show a report's clouds in 3D and its curves with their values, and the console's page: needs npm, and its registry the first time" OFF)

set(TANKRIG_WEB ${PROJECT_BINARY_DIR}/web)
if(TANKRIG_CLOUD_VIEW)
  find_program(NPM npm REQUIRED)
  set(from ${CMAKE_CURRENT_LIST_DIR}/web)
  add_custom_command(OUTPUT ${TANKRIG_WEB}/fetched DEPENDS ${from}/package.json ${from}/package-lock.json
    COMMAND ${CMAKE_COMMAND} -E make_directory ${TANKRIG_WEB}
    COMMAND ${CMAKE_COMMAND} -E copy ${from}/package.json ${from}/package-lock.json ${TANKRIG_WEB}
    COMMAND ${NPM} --prefix ${TANKRIG_WEB} ci --ignore-scripts --no-audit --no-fund --loglevel=error
    COMMAND ${CMAKE_COMMAND} -E touch ${TANKRIG_WEB}/fetched
    COMMENT "Fetching the packages of the pages" VERBATIM)
  add_custom_target(tankrig_web_packages DEPENDS ${TANKRIG_WEB}/fetched)
endif()

# tankrig_bundle(NAME FROM folder PROGRAMS name... [ALSO file...] [OPTIONS option...] OUTPUTS file... [LICENCES command...]): bundles FROM/name.ts, whose
# imports lie beside it, as web/NAME/name.js of the build folder, if its types are right.
function(tankrig_bundle name)
  cmake_parse_arguments(ARG "" "FROM" "PROGRAMS;ALSO;OPTIONS;OUTPUTS;LICENCES" ${ARGN})
  set(web ${TANKRIG_WEB}/${name})
  file(GLOB sources CONFIGURE_DEPENDS ${ARG_FROM}/*.ts ${ARG_FROM}/tsconfig.json)
  list(TRANSFORM ARG_PROGRAMS APPEND .ts OUTPUT_VARIABLE programs)
  add_custom_command(OUTPUT ${ARG_OUTPUTS} DEPENDS ${sources} ${ARG_ALSO} tankrig_web_packages ${TANKRIG_WEB}/fetched
    COMMAND ${CMAKE_COMMAND} -E rm -rf ${web}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${web}
    COMMAND ${CMAKE_COMMAND} -E copy ${sources} ${web}
    COMMAND ${CMAKE_COMMAND} -E chdir ${web} ${TANKRIG_WEB}/node_modules/.bin/tsc --noEmit
    COMMAND ${CMAKE_COMMAND} -E chdir ${web} ${TANKRIG_WEB}/node_modules/.bin/esbuild ${programs} --bundle --minify --format=iife --target=es2021
      --legal-comments=none --log-level=warning ${ARG_OPTIONS} --outdir=.
    ${ARG_LICENCES}
    COMMENT "Bundling the pages: ${name}" VERBATIM)
endfunction()

# tankrig_licence(VARIABLE BUNDLE LIBRARY OUT): a command for LICENCES that puts the library's licence before the bundle.
function(tankrig_licence variable bundle library out)
  set(${variable} ${${variable}} COMMAND ${CMAKE_COMMAND} -DBUNDLE=${bundle} -DLIBRARY=${library} -DWEB=${TANKRIG_WEB} -DOUT=${out}
    -P ${PROJECT_SOURCE_DIR}/cmake/web/with_licence.cmake PARENT_SCOPE)
endfunction()
