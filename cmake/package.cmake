# `./run package`: the component `program` as a Debian package, made by `cpack -G DEB`.
# What only a package may put: the limits where pam_limits reads them, a configuration file of the administrator's from then on.
install(FILES etc/limits.d/tankrig.conf DESTINATION ../etc/security/limits.d COMPONENT package EXCLUDE_FROM_ALL)
install(FILES cmake/debian/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/tankrig COMPONENT package EXCLUDE_FROM_ALL)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME tankrig)
set(CPACK_PACKAGE_CONTACT "tankrig authors")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "scan an object in a water tank with a laser line and with stereo cameras")
set(CPACK_PACKAGE_DESCRIPTION "Sweeps a laser line on a robot arm over an object in a tank, records a session,
reconstructs it by laser stripe and by stereo, and scores the clouds against its mesh.
Runs on a simulated rig, on emulated devices that speak the real protocols, and on a real rig.
Installing it starts nothing and moves nothing. Needs a processor with SSE4.2 (x86-64-v2).")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_COMPONENTS_ALL program package)
set(CPACK_COMPONENTS_GROUPING ALL_COMPONENTS_IN_ONE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "passwd")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "iproute2, bash-completion, man-db, bubblewrap")
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/debian/postinst ${PROJECT_SOURCE_DIR}/cmake/debian/postrm
  ${PROJECT_SOURCE_DIR}/cmake/debian/conffiles)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
include(CPack)
