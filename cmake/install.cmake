# What `cmake --install` puts where, in two components: the program with all that a user of it needs, and the libraries from a
# session to its report for other people's programs.
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME development)
install(DIRECTORY etc/rigs etc/scenes etc/objects etc/benchmarks DESTINATION ${CMAKE_INSTALL_DATADIR}/tankrig COMPONENT program
  PATTERN "*.commission.yaml" EXCLUDE)  # a start-up test is of one rig
install(FILES etc/limits.d/tankrig.conf DESTINATION ${CMAKE_INSTALL_DATADIR}/tankrig/limits.d COMPONENT program)
install(DIRECTORY etc/systemd/ DESTINATION lib/systemd/system COMPONENT program)
install(DIRECTORY etc/udev/ DESTINATION lib/udev/rules.d COMPONENT program)
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)

set(manual ${CMAKE_CURRENT_BINARY_DIR}/tankrig.1)
set(completion ${CMAKE_CURRENT_BINARY_DIR}/tankrig.bash)
install(CODE "
  execute_process(COMMAND \"$<TARGET_FILE:tankrig>\" manual OUTPUT_FILE \"${manual}\" COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND \"$<TARGET_FILE:tankrig>\" completion bash OUTPUT_FILE \"${completion}\" COMMAND_ERROR_IS_FATAL ANY)"
  COMPONENT program)
install(FILES ${manual} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
install(FILES ${completion} DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME tankrig COMPONENT program)

set(libraries core session cloud pointcloud stripe stereo metrics report time_offset pipeline)
list(TRANSFORM libraries PREPEND tankrig_ OUTPUT_VARIABLE targets)
install(TARGETS ${targets} EXPORT tankrigTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
foreach(library ${libraries})
  set_target_properties(tankrig_${library} PROPERTIES EXPORT_NAME ${library})
endforeach()
install(DIRECTORY core session calibration reconstruction bench pipeline DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tankrig
  FILES_MATCHING PATTERN "*.hpp" PATTERN export EXCLUDE PATTERN visp EXCLUDE PATTERN benchmark EXCLUDE PATTERN sweep EXCLUDE
  PATTERN boards EXCLUDE PATTERN estimate EXCLUDE PATTERN marker EXCLUDE PATTERN hand_eye EXCLUDE PATTERN intrinsics EXCLUDE PATTERN
  calibration/stereo EXCLUDE PATTERN object_pose EXCLUDE)

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/tankrig)
install(EXPORT tankrigTargets NAMESPACE tankrig:: DESTINATION ${package})
include(CMakePackageConfigHelpers)
write_basic_package_version_file(tankrigConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES cmake/tankrigConfig.cmake cmake/dependencies.cmake ${CMAKE_CURRENT_BINARY_DIR}/tankrigConfigVersion.cmake DESTINATION ${package})
