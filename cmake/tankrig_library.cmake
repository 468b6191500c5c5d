# tankrig_library(NAME [IN folder...] [PUBLIC target...] [PRIVATE target...]): the *.cpp of the folders, or of this one,
# as the static library tankrig_NAME.
function(tankrig_library name)
  cmake_parse_arguments(ARG "" "" "IN;PUBLIC;PRIVATE" ${ARGN})
  if(NOT ARG_IN)
    set(ARG_IN .)
  endif()
  list(TRANSFORM ARG_IN APPEND /*.cpp)
  file(GLOB sources CONFIGURE_DEPENDS ${ARG_IN})
  add_library(tankrig_${name} STATIC ${sources})
  target_link_libraries(tankrig_${name} PUBLIC ${ARG_PUBLIC} PRIVATE $<BUILD_INTERFACE:tankrig_options> ${ARG_PRIVATE})
  target_include_directories(tankrig_${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/tankrig>)
  tankrig_precompile(tankrig_${name} tankrig_core)
endfunction()

# tankrig_module(NAME USER FOLDER target...): the *.cpp of the folder as lib/tankrig/tankrig_NAME.so, which the library USER loads by
# core/module.hpp. It holds what it needs of ours itself, and shares the libraries that are loaded anyway.
function(tankrig_module name user folder)
  file(GLOB sources CONFIGURE_DEPENDS ${folder}/*.cpp)
  add_library(tankrig_${name}_module MODULE ${sources})
  target_link_libraries(tankrig_${name}_module PRIVATE tankrig_options ${ARGN})
  target_include_directories(tankrig_${name}_module PRIVATE ${PROJECT_SOURCE_DIR})
  target_compile_definitions(tankrig_${name}_module PRIVATE $<TARGET_PROPERTY:tankrig_core,INTERFACE_COMPILE_DEFINITIONS>)
  set_target_properties(tankrig_${name}_module PROPERTIES PREFIX "" OUTPUT_NAME tankrig_${name}
    LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib/tankrig)
  add_dependencies(${user} tankrig_${name}_module)
  install(TARGETS tankrig_${name}_module LIBRARY DESTINATION lib/tankrig COMPONENT program)
endfunction()

# tankrig_page(TARGET FOLDER/NAME): NAME.html.mustache is compiled in as kNameTemplate; nothing has to be found when a page is written.
function(tankrig_page target page)
  get_filename_component(name ${page} NAME)
  string(SUBSTRING ${name} 0 1 first)
  string(TOUPPER ${first} first)
  string(SUBSTRING ${name} 1 -1 rest)
  file(READ ${page}.html.mustache template)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${page}.html.mustache)
  file(CONFIGURE OUTPUT ${name}_template.cpp @ONLY CONTENT [[
namespace tankrig {
extern const char* const k@first@@rest@Template;
const char* const k@first@@rest@Template = R"mustache(@template@)mustache";
}  // namespace tankrig
]])
  target_sources(${target} PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/${name}_template.cpp)
endfunction()

add_library(tankrig_options INTERFACE)
target_compile_options(tankrig_options INTERFACE -Wall -Wextra -Wshadow -ffp-contract=off)
if(TANKRIG_UNITY)
  target_compile_options(tankrig_options INTERFACE -Wno-subobject-linkage)  # takes every .cpp but the first for a header
endif()
if(CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
  target_compile_options(tankrig_options INTERFACE -march=${TANKRIG_ISA})
endif()
