# What `cmake --install` writes: libraries, headers, and a package that find_package(avatar_player) finds.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(AVATAR_PACKAGE ${CMAKE_INSTALL_LIBDIR}/cmake/avatar_player)
set(AVATAR_PACKAGE_VERSION ${CMAKE_CURRENT_BINARY_DIR}/avatar_player-config-version.cmake)

if(TARGET avatar_d3d11)
  set(AVATAR_D3D11 avatar_d3d11)
  install(FILES d3d11/avatar_d3d11.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
endif()
install(TARGETS avatar_player avatar_gles ${AVATAR_D3D11} EXPORT avatar_player-targets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
  INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(FILES include/avatar_conform.h include/avatar_light.h include/avatar_player.h gles/avatar_gles.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT avatar_player-targets NAMESPACE avatar_player:: DESTINATION ${AVATAR_PACKAGE})
# Before 1.0 a minor version may change functions.
write_basic_package_version_file(${AVATAR_PACKAGE_VERSION} COMPATIBILITY SameMinorVersion)
install(FILES ${AVATAR_PACKAGE_VERSION} cmake/avatar_player-config.cmake DESTINATION ${AVATAR_PACKAGE})
