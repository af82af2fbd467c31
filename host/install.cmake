# `cmake --install`: the library, its headers, the program, and what find_package(smurf) reads.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(SMURF_CMAKE_FOLDER ${CMAKE_INSTALL_LIBDIR}/cmake/smurf)

install(TARGETS smurf EXPORT smurf-targets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(TARGETS smurf-program RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
# What `smurf gallery` draws, and the licence of the data.
install(FILES data/headsq.json data/headsq.nhdr data/headsq_64x64x93_uint16le.raw.gz data/README.md
  DESTINATION ${CMAKE_INSTALL_DATADIR}/smurf)
install(DIRECTORY include/smurf DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT smurf-targets NAMESPACE smurf:: DESTINATION ${SMURF_CMAKE_FOLDER})

configure_package_config_file(smurf-config.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/smurf-config.cmake
  INSTALL_DESTINATION ${SMURF_CMAKE_FOLDER})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/smurf-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/smurf-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/smurf-config-version.cmake
  DESTINATION ${SMURF_CMAKE_FOLDER})
