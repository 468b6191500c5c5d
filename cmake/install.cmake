# What `cmake --install` puts where: the program, its rigs and scenes, and the libraries from a session to its report.
install(DIRECTORY etc/ DESTINATION ${CMAKE_INSTALL_DATADIR}/tankrig)

set(libraries core session cloud pointcloud stripe stereo metrics report time_offset pipeline)
list(TRANSFORM libraries PREPEND tankrig_ OUTPUT_VARIABLE targets)
install(TARGETS ${targets} EXPORT tankrigTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
foreach(library ${libraries})
  set_target_properties(tankrig_${library} PROPERTIES EXPORT_NAME ${library})
endforeach()
install(DIRECTORY core session calibration reconstruction bench pipeline DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tankrig
  FILES_MATCHING PATTERN "*.hpp" PATTERN export EXCLUDE)

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/tankrig)
install(EXPORT tankrigTargets NAMESPACE tankrig:: DESTINATION ${package})
include(CMakePackageConfigHelpers)
write_basic_package_version_file(tankrigConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES cmake/tankrigConfig.cmake cmake/dependencies.cmake ${CMAKE_CURRENT_BINARY_DIR}/tankrigConfigVersion.cmake DESTINATION ${package})
